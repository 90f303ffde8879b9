"""Page 7: what stands there of each device, and its state in a word."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rig.console.view_model.bench_text import bench_text, device_state
from rig.console.view_model.view import View, absorb
from tests.rig.console.feeds import DEVICES, running, snapshot
from tests.rig.console.scenes import NO_ANSWER, SCENES
from tests.rig.console.sitting import sitting

CELL, MOTOR, FLOW, THERMOMETER = DEVICES


def told(**changes) -> str:
    return bench_text(absorb(View(), running(**changes), 10.0)).plain


def paragraph(name: str, text: str) -> str:
    return next(part for part in text.split("\n\n") if part.startswith(name))


@pytest.mark.parametrize(
    ("device", "word"),
    [
        (CELL, "ok"),
        (replace(CELL, fault="its port is gone"), "LOST"),
        (replace(CELL, identity="", fault=""), "NOT OPEN"),
        (replace(CELL, streams=(replace(CELL.streams[0], age=None),)), "SILENT"),
        (replace(CELL, streams=(replace(CELL.streams[0], age=1.01),)), "SILENT"),
        (replace(FLOW, streams=(replace(FLOW.streams[0], age=1.24),)), "ok"),
        (replace(FLOW, streams=(replace(FLOW.streams[0], age=1.26),)), "SILENT"),
        (replace(CELL, streams=(replace(CELL.streams[0], rate=68.0),)), "RATE"),
        (replace(CELL, streams=(replace(CELL.streams[0], rate=70.0),)), "ok"),
    ],
)
def test_state_of_a_device(device, word):
    assert device_state(device, 0.0, live=True) == word
    assert device_state(device, 0.0, live=False) == "OLD"


def test_a_paragraph_says_identity_port_rates_frames_and_calibration():
    cell = paragraph("load_cell", told())
    calibrated = "calibrated 2026-03-02 (DKD 1234), valid until 2027-03-01: 100 days left"
    for said in ("ok  mt_sics on /dev/ttyUSB0", CELL.identity, "91.8/s of 92/s", "newest 0.01 s old",
                 "0 of 4321 frames not understood", calibrated):  # fmt: skip
        assert said in cell
    assert "2 of 190 frames not understood, first: $PNORC1" in paragraph("flow", told())
    assert "valid until 2026-09-19: OVER for 63 days" in paragraph("thermometer", told())
    assert "no date of one" in paragraph("motor", told())


def test_the_watchdog_is_told_as_declared_and_as_measured():
    motor = paragraph("motor", told())
    assert "watchdog: 0.5 s, then coast; fed by SET_* commands" in motor
    assert "watchdog measured: at rest 1.31 s after the last command" in motor
    unproved = (CELL, replace(MOTOR, watchdog_measured=None))
    assert "not measured yet" in paragraph("motor", told(devices=unproved))


def test_limits_stand_below():
    limits = paragraph("limits", told())
    assert "load_cell.thrust" in limits
    assert "-300 … 300 N" in limits
    assert "at most 0.2 s old" in limits


def test_a_device_that_did_not_open_says_why():
    scene = SCENES["bench_trouble"].snapshots[-1]
    assert NO_ANSWER in paragraph("flow", bench_text(absorb(View(), scene, 10.0)).plain)


def test_ages_grow_while_nothing_comes():
    view = replace(absorb(View(), running(), 10.0), now=12.0)
    text = bench_text(view).plain
    assert "newest 2.01 s old" in text
    assert "OLD" in paragraph("load_cell", text)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_key_7_shows_it_and_nothing_is_cut_off_to_the_right(size):
    async with sitting(running(), size=size) as desk:
        await desk.press("7")
        await desk.draw()
        shown = "".join(desk.text("BenchPanel").split())
        assert shown == "".join(bench_text(desk.app.state).plain.split())


async def test_it_follows_and_it_scrolls_by_keys():
    async with sitting(running()) as desk:
        await desk.press("7")
        await desk.play(running(devices=(replace(CELL, fault="its port is gone"), *DEVICES[1:])))
        assert "LOST" in desk.text("BenchPanel")
        page = desk.app.query_one("#bench")
        await desk.press("pagedown")
        await desk.draw()
        assert page.scroll_offset.y > 0


async def test_nothing_is_known_before_the_controller_tells_it():
    async with sitting(snapshot("connecting", devices=())) as desk:
        await desk.press("7")
        await desk.draw()
        assert "No device is known yet" in desk.text("BenchPanel")
