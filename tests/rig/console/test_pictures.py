"""The console against accepted pictures; `pytest tests/rig/console --snapshot-update` accepts new ones."""

from __future__ import annotations

import pytest

from tests.rig.console.scenes import SCENES, prepare


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["80x24", "120x40"])
@pytest.mark.parametrize("scene", SCENES)
def test_picture(snap_compare, scene, size):
    app, play = prepare(SCENES[scene])
    assert snap_compare(app, terminal_size=size, run_before=play)
