"""The editor against accepted pictures; `pytest tests/rig/console/editor --snapshot-update` accepts new ones."""

from __future__ import annotations

import pytest

from tests.rig.console.editor.editor_desk import SCENES, campaign_here, editor, play


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def picture(scene: str, colors: str = "full"):
    keys = SCENES[scene]
    return editor(campaign_here(), colors), lambda pilot: play(pilot, *keys)


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["80x24", "120x40"])
@pytest.mark.parametrize("scene", SCENES)
def test_editor_picture(snap_compare, scene, size):
    app, run = picture(scene)
    assert snap_compare(app, terminal_size=size, run_before=run)


def test_editor_picture_of_a_large_terminal(snap_compare):
    app, run = picture("opened")
    assert snap_compare(app, terminal_size=(160, 48), run_before=run)


@pytest.mark.parametrize("colors", ["16", "none"])
@pytest.mark.parametrize("scene", ["limit", "no_number", "leave"])
def test_editor_picture_with_few_colors(snap_compare, scene, colors):
    app, run = picture(scene, colors)
    assert snap_compare(app, terminal_size=(80, 24), run_before=run)
