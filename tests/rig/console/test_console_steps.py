"""Keys of a step, of a console that only looks on, and of the diagnosis; what rings, and the time to zero."""

from __future__ import annotations

import sys
from dataclasses import replace

import pytest

from rig.console.app import ConsoleApp
from rig.console.diagnosing import DiagnosisPanel
from rig.console.key_help import KeyHelp
from rig.console.view_model.keys import EVERY_KEY
from rig.link.front_end_messages import Request
from tests.rig.console.feeds import campaign, running
from tests.rig.console.scenes import settle
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


async def test_the_page_of_keys_has_them_all_and_the_stop_key_works_on_it():
    async with sitting(running()) as desk:
        await desk.press("question_mark")
        assert isinstance(desk.app.screen, KeyHelp)
        known = " ".join(key for key, _ in EVERY_KEY).lower()
        keys = {binding.key for binding in ConsoleApp.BINDINGS} - {"?"}
        assert all(key in known or key in "2345" for key in keys)
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
        desk.app._renew_lease()
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


SAYS = (sys.executable, "-c", "import sys; print('explained', sys.argv[1])")


async def test_g_diagnoses_each_recording_once_the_campaign_has_ended():
    ended = replace(campaign()[-1], files=("run/T1.h5", "run/T2.h5"))
    async with sitting(ended) as desk:
        desk.app.diagnose = SAYS
        await desk.press("g")
        await settle(desk.pilot, lambda: "explained run/T2.h5" in desk.text(DiagnosisPanel))
        assert "T1.h5" in desk.text(DiagnosisPanel)
        assert desk.app.query_one("#pages").current == "diagnosis"
        assert desk.kinds() == []


async def test_while_something_may_turn_nothing_is_diagnosed():
    async with sitting(running()) as desk:
        desk.app.diagnose = SAYS
        await desk.press("g")
        assert any("Once the campaign has ended" in text for text in desk.toasts())
        assert desk.app.query_one("#pages").current == "live"
