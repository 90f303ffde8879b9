"""The console against accepted pictures; `pytest tests/rig/console --snapshot-update` accepts new ones."""

from __future__ import annotations

import pytest

from tests.rig.console.scenes import SCENES, prepare

FEW_COLORS = ("preflight_failed", "mismatch", "limit", "paused", "wait", "stop_not_confirmed", "disconnected", "note",
              "leave_attended", "end", "bench_trouble", "palette_not_now", "channels", "misfit",
              "mismatch_time", "diagnoses", "next_sweep", "history", "compare")  # fmt: skip
"""Scenes that are told by colour where there is one: each has a word or a sign too."""


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["80x24", "120x40"])
@pytest.mark.parametrize("scene", SCENES)
def test_picture(snap_compare, scene, size):
    app, play = prepare(SCENES[scene])
    assert snap_compare(app, terminal_size=size, run_before=play)


def test_picture_of_a_large_terminal(snap_compare):
    app, play = prepare(SCENES["sweep"])
    assert snap_compare(app, terminal_size=(200, 60), run_before=play)


@pytest.mark.parametrize("colors", ["16", "none"])
@pytest.mark.parametrize("scene", FEW_COLORS)
def test_picture_with_few_colors(snap_compare, scene, colors):
    app, play = prepare(SCENES[scene], colors)
    assert snap_compare(app, terminal_size=(120, 40) if scene == "mismatch" else (80, 24), run_before=play)
