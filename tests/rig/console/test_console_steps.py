"""Keys of a step, of a console that only looks on, and of the diagnosis; what rings, and the time to zero."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rig.console.app import ConsoleApp
from rig.console.dialogs import NoteDialog
from rig.console.key_help import KeyHelp
from rig.console.view_model.keys import EVERY_KEY
from rig.link.front_end_messages import LogLine, Progress, Request
from tests.rig.console.feeds import LOG, ManualClock, PlayedFeed, running, snapshot
from tests.rig.console.scenes import SCENES, prepare, settle, show
from tests.rig.console.sitting import sitting


@pytest.mark.parametrize(
    ("key", "kind"), [("a", "accept"), ("x", "extend"), ("t", "repeat"), ("b", "back"), ("k", "skip"), ("m", "bad")]
)
async def test_each_key_of_a_step_asks_for_one_thing(key, kind):
    async with sitting(running()) as desk:
        await desk.press(key)
        assert desk.kinds() == [kind]


async def test_a_wait_and_a_pause_say_what_for_and_how_long():
    async with sitting(running("wait", command=0.0, reason="water settles: 43 s left")) as desk:
        assert desk.alarm() == "WAITING at 0 V — water settles: 43 s left. k goes on now."
        assert "go on now" in desk.text("#keys")
        await desk.press("k")
        assert desk.kinds() == ["skip"]
        await desk.play(running("paused", command=0.0, state_elapsed=83.0, reason="by the operator"))
        assert desk.alarm().startswith("PAUSED at 0 V for 1:23, by the operator")


PREFLIGHT = tuple(LogLine(0.1 * n, "info", f"preflight: check {n}: passed", -1) for n in range(30))
BEFORE = LogLine(3.1, "warning", "preflight: thermometer: last calibration 14 months ago", -1)
TRIP = LogLine(47.0, "trip", "motor.current 41.2 A is above its limit", 0)


async def test_f_chooses_which_events_are_shown():
    log = (*PREFLIGHT, BEFORE, *LOG, TRIP)
    async with sitting(running(log=log, log_count=len(log)), size=(120, 60)) as desk:
        await desk.press("4")
        await desk.draw()
        shown = desk.text("#log")
        assert "preflight" not in shown
        assert "tare: 0.31" in shown
        assert TRIP.text in shown
        await desk.press("f")
        await desk.draw()
        shown = desk.text("#log")
        assert BEFORE.text in shown
        assert "tare: 0.31" not in shown
        assert TRIP.text in shown
        await desk.press("f")
        await desk.draw()
        shown = desk.text("#log")
        assert "check 29: passed" in shown
        assert "tare: 0.31" in shown
        await desk.press("f")
        more = (*log, LogLine(48.0, "info", "a new one", 0))
        await desk.play(running(t=48.0, log=more, log_count=len(more)))
        assert "a new one" in desk.text("#log")
        assert "preflight" not in desk.text("#log")


async def test_before_the_start_all_events_are_shown_and_the_next_run_has_its_own():
    async with sitting(snapshot("preflight", log=PREFLIGHT[:5], log_count=5), size=(120, 60)) as desk:
        await desk.press("4")
        await desk.draw()
        assert desk.text("#log").count("preflight: check") == 5
        second = running().progress
        log = (*LOG, LogLine(60.0, "info", "put T3 on the bench", 1))
        await desk.play(running("mount", progress=replace(second, run=1), log=log, log_count=len(log)))
        assert "put T3" in desk.text("#log")
        assert "tare: 0.31" not in desk.text("#log")


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
@pytest.mark.parametrize("scene", ["sweep", "limit", "events"])
async def test_no_toast_covers_an_event(scene, size):
    app, play = prepare(SCENES[scene])
    async with app.run_test(size=size, notifications=True) as pilot:
        await play(pilot)
        await pilot.press("t")
        await settle(pilot, lambda: bool(app.screen.query("Toast")))
        await show(pilot, app)
        (toast,) = app.screen.query("Toast")
        assert toast.region.height == 1
        assert not toast.region.intersection(app.query_one("#log").content_region)
        for above in (".alarm", ".head-row"):
            assert not toast.region.intersection(app.query_one(above).region)


@pytest.mark.parametrize("last", ["enter", "escape"])
async def test_a_key_right_after_the_end_of_a_note_is_for_the_page(last):
    async with sitting(running()) as desk:
        await desk.press("n")
        assert isinstance(desk.app.screen, NoteDialog)
        for key in ("w", "e", "e", "d", last, "p", "f9"):
            desk.app.simulate_key(key)
        await settle(desk.pilot, lambda: "pause" in desk.kinds())
        assert [request.text for request in desk.feed.sent if request.kind == "note"] == ["weed"] * (last == "enter")
        assert desk.kinds()[0] == "stop"  # it waits behind nothing
        assert len(desk.app.screen_stack) == 1
        await desk.press("n", "x", "enter", "k")
        assert desk.kinds()[-1] == "skip"


@pytest.mark.parametrize("last", ["enter", "escape"])
async def test_a_note_whose_field_has_lost_its_focus_closes_and_keys_go_on(last):
    async with sitting(running()) as desk:
        await desk.press("n", *"weed")
        desk.app.screen.set_focus(None)
        await desk.press(last, "p")
        assert [request.text for request in desk.feed.sent if request.kind == "note"] == ["weed"] * (last == "enter")
        assert len(desk.app.screen_stack) == 1
        assert desk.kinds()[-1] == "pause"


async def test_the_page_of_keys_has_them_all_and_the_stop_key_works_on_it():
    async with sitting(running()) as desk:
        await desk.press("question_mark")
        assert isinstance(desk.app.screen, KeyHelp)
        known = " ".join(key for key, _ in EVERY_KEY).lower()
        keys = {key for binding in ConsoleApp.BINDINGS for key in binding.key.split(",")}
        assert all(key in known or key in "234567" for key in keys)
        await desk.press("p", "f9")
        assert desk.kinds() == ["stop"]
        await desk.press("escape")
        assert len(desk.app.screen_stack) == 1


async def test_the_time_from_the_stop_key_to_zero_is_on_the_screen():
    async with sitting(running()) as desk:
        await desk.press("f9")
        desk.clock.now += 0.08
        await desk.play(running("stopping", command=0.0))
        assert "command is 0 V, 80 ms after your key" in desk.alarm()
        await desk.press("f9")
        await desk.wait(1.0)
        await desk.play(running("stopping", command=0.0))
        assert "80 ms after your key" in desk.alarm()


async def test_no_time_to_zero_is_told_for_a_key_that_came_after_the_stop():
    async with sitting(running("stopping", command=0.0)) as desk:
        await desk.press("f9")
        await desk.play(running("stopping", command=0.0))
        assert "after your key" not in desk.alarm()


ON_TOP = [
    *((str(n),) for n in range(1, 7)),
    ("n", "a", "b"),
    ("d",),
    ("d", "tab"),
    ("question_mark",),
    ("colon", "p"),
    ("4", "tab"),
]


@pytest.mark.parametrize("size", [(80, 24), (200, 60)])
@pytest.mark.parametrize("keys", ON_TOP, ids="-".join)
async def test_the_time_to_zero_is_on_every_page_dialog_and_focused_field(keys, size):
    async with sitting(running(), size=size) as desk:
        await desk.press(*keys)
        await desk.draw()
        desk.app.simulate_key("f9")
        assert desk.kinds() == ["stop"]  # before the event loop has turned
        desk.clock.now += 0.06
        await desk.play(running("stopping", command=0.0))
        assert "command is 0 V, 60 ms after your key" in desk.alarm()
        line = desk.app.screen.query_one(".alarm")
        assert line.region in desk.app.screen.region
        assert line.size.width > 40
        end = running("done", command=0.0, outcome="aborted", cause="stopped by console.", stop_confirmed=True)
        await desk.play(end)
        assert "0 V 60 ms after your key. Propeller measured at rest." in desk.alarm()


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
async def test_the_bars_keep_their_length_on_every_page(size):
    progress = Progress(1023, 1024, 1234.5, 1300.0, 11, 12, 35999.0, 35999.0, 0.5)
    async with sitting(running(thruster="SN0412", progress=progress), size=size) as desk:
        for page in ("1", "2", "3", "4", "1"):
            await desk.press(page)
            await desk.draw()
            bars = [sum(line.count(cell) for cell in "█░") for line in desk.text("#progress").splitlines()]
            assert bars[0] >= size[0] - 70
            assert bars[1] >= size[0] - 70


async def test_what_somebody_must_come_for_rings_once(monkeypatch):
    rung = []
    monkeypatch.setattr(ConsoleApp, "bell", lambda app: rung.append(app.state.snapshot.state))
    async with sitting(running()) as desk:
        await desk.play(running("mount", thruster="T3", mounted_by_hand=True))
        await desk.play(running("mount", thruster="T3", mounted_by_hand=True))
        await desk.play(running())
        await desk.play(running("paused", command=0.0))
        await desk.play(running("done", outcome="completed"))
    assert rung == ["mount", "paused", "done"]


async def test_a_silent_console_never_rings(monkeypatch):
    rung = []
    monkeypatch.setattr(ConsoleApp, "bell", lambda app: rung.append(app))
    async with sitting(running()) as desk:
        desk.app.silent = True
        await desk.play(running("done", outcome="completed"))
    assert rung == []


async def test_a_second_console_looks_on_until_it_takes_the_lease():
    async with sitting(running(attended=True, clients=2)) as desk:
        assert "READ-ONLY" in desk.text(".head-state")
        await desk.press("p", "a", "m")
        assert desk.kinds() == []
        desk.app.renew_lease()
        assert desk.feed.sent[-1] == Request("watch")
        await desk.press("l")
        assert desk.feed.sent[-1] == Request("lease")
        assert "READ-ONLY" not in desk.text(".head-state")
        await desk.press("p")
        assert desk.kinds() == ["pause"]


async def test_the_stop_key_works_on_a_console_that_looks_on_and_it_leaves_without_a_question():
    async with sitting(running(attended=True, clients=2)) as desk:
        await desk.press("f9")
        assert desk.kinds() == ["stop"]
        await desk.press("d")
        await desk.pilot.pause()
    assert not desk.app.is_running


async def test_the_first_console_goes_on_attending_when_others_come():
    async with sitting(running(attended=True, clients=1)) as desk:
        await desk.play(running(t=48.0, attended=True, clients=3))
        await desk.press("p")
        assert desk.kinds() == ["pause"]


async def test_a_console_of_a_browser_looks_on_also_when_nobody_attends():
    feed, clock = PlayedFeed(running(attended=True, clients=0)), ManualClock()
    app = ConsoleApp(feed, clock, looks_on=True)
    async with app.run_test() as pilot:
        await settle(pilot, lambda: app.state.snapshot is not None)
        await pilot.press("p", "f5", "n")
        assert len(app.screen_stack) == 1  # no line is asked for that could not be kept
        assert {request.kind for request in feed.sent} == {"watch"}
        looked_on = len(feed.sent)
        await pilot.press("l", "p")
        assert feed.kinds() == ["pause"]
        assert {request.kind for request in feed.sent[looked_on:]} <= {"watch", "lease", "pause"}
        assert Request("lease") in feed.sent[looked_on:]
        assert feed.sent[-1] != Request("watch")
