"""The command palette: every action by name, what is not possible with its reason, and keys typed in a burst."""

from __future__ import annotations

import pytest
from textual.widgets import Input, OptionList, Static

from rig.console.app import ConsoleApp
from rig.console.chooser import Chooser
from rig.console.dialogs import LeaveDialog, NoteDialog
from rig.console.key_help import KeyHelp
from rig.console.view_model.actions import ACTIONS, PAGES
from rig.console.view_model.keys import EVERY_KEY
from rig.console.view_model.palette import Entry, commands, matching
from rig.console.view_model.view import View, absorb
from rig.link.front_end_messages import Check, Snapshot, State
from rig.sequence.requests import ASKED
from tests.rig.console.feeds import CHECKS, campaign, running, snapshot
from tests.rig.console.scenes import settle
from tests.rig.console.sitting import sitting


def seen(shown: Snapshot) -> View:
    return absorb(View(), shown, 0.0)


def refused(shown: Snapshot) -> dict[str, str]:
    """Name -> why not, of what is not possible."""
    return {entry.name: entry.not_now for entry in commands(seen(shown)) if entry.not_now}


def test_every_action_has_a_name_a_key_and_one_place():
    assert len({action.name for action in ACTIONS}) == len(ACTIONS)
    keys = [key for action in ACTIONS for key in action.key.split(", ")]
    assert len(set(keys)) == len(keys)
    assert {entry.name for entry in commands(View())} == {action.name for action in ACTIONS} - {"palette"}
    assert len(EVERY_KEY) == len(ACTIONS) - len(PAGES) + 1  # the pages share a line


def test_each_action_is_known_to_the_application():
    for action in ACTIONS:
        assert callable(getattr(ConsoleApp, f"action_{action.run.partition('(')[0]}"))


@pytest.mark.parametrize("state", ["proving", "tare", "ramp", "hold", "rest", "wait", "sine", "paused"])
def test_what_is_possible_is_what_the_sequencer_obeys(state: State):
    not_now = refused(running(state))
    for action in ACTIONS:
        kind = action.run.removeprefix("ask('").removesuffix("')")
        if kind in ASKED:
            assert (action.name not in not_now) == (state in ASKED[kind][0]), action.name  # type: ignore[index]
    assert ("resume" in not_now) == (state != "paused")


def test_reasons_of_the_start():
    waiting = Check("watchdog", "waiting", "")
    assert "start" not in refused(snapshot("preflight"))
    assert refused(snapshot("preflight", checks=(*CHECKS, waiting)))["start"] == "the check of watchdog still runs"
    failed = Check("flow", "failed", "no answer")
    assert refused(snapshot("preflight", checks=(waiting, failed)))["start"] == "flow FAILED"
    assert refused(running())["start"] == "the controller waits for no start"
    assert "start" not in refused(running("mount", mounted_by_hand=True))
    assert "start" in refused(running("mount", mounted_by_hand=False))


def test_who_looks_on_may_stop_attend_and_look():
    not_now = refused(running(attended=True, clients=2))
    assert not_now["pause"] == "this console looks on; l attends"
    assert {"note", "start", "resume", "skip"} <= set(not_now)
    assert not {"STOP", "attend", "leave", "keys", "page time"} & set(not_now)
    assert refused(running())["attend"] == "this console attends"
    assert refused(running())["diagnose"] == "the campaign has not ended"
    assert "diagnose" not in refused(campaign()[-1])


def test_matching_puts_the_beginning_of_a_name_before_what_is_said_of_it():
    found = [entry.name for entry in matching(commands(seen(running())), "s")]
    assert found[:2] == ["skip", "STOP"]
    assert found.index("start") < found.index("take again")  # which says "step"
    assert [entry.name for entry in matching(commands(seen(running())), "take")][:1] == ["take again"]
    assert matching((Entry("v", "skip", "k", "leave out"),), "zzz") == ()
    assert len(matching(commands(View()), "  ")) == len(commands(View()))


@pytest.mark.parametrize("key", ["colon", "ctrl+p"])
async def test_a_burst_is_typed_into_the_palette_and_nothing_of_it_reaches_the_page(key):
    async with sitting(running()) as desk:
        for one in (key, *"take ag", "enter", "p"):
            desk.app.simulate_key(one)
        await settle(desk.pilot, lambda: "pause" in desk.kinds())
        assert desk.kinds() == ["repeat", "pause"]
        assert len(desk.app.screen_stack) == 1


async def test_a_burst_into_a_note_opened_from_the_palette():
    async with sitting(running()) as desk:
        for one in ("colon", *"note", "enter", *"xp", "enter", "k"):
            desk.app.simulate_key(one)
        await settle(desk.pilot, lambda: "skip" in desk.kinds())
        assert [(request.kind, request.text) for request in desk.feed.sent if request.kind in ("note", "skip")] == [
            ("note", "xp"), ("skip", "")]  # fmt: skip


async def test_arrows_choose_and_escape_closes():
    async with sitting(running()) as desk:
        await desk.press("colon", "down", "down", "up", "enter")
        assert desk.kinds() == ["accept"]
        await desk.press("colon", *"skip", "escape", "p")
        assert desk.kinds() == ["accept", "pause"]


async def test_a_click_chooses():
    async with sitting(running()) as desk:
        await desk.press("colon")
        await desk.draw()
        await desk.pilot.click(OptionList, offset=(5, 1))
        await desk.pilot.pause()
        assert desk.kinds() == ["accept"]
        assert len(desk.app.screen_stack) == 1


async def test_what_is_not_possible_is_refused_with_its_reason_and_the_palette_stays():
    async with sitting(running()) as desk:
        await desk.press("colon", *"start", "enter")
        assert isinstance(desk.app.screen, Chooser)
        assert desk.kinds() == []
        assert "start: not now, the controller waits for no start" in str(
            desk.app.screen.query_one(".dialog-hint", Static).render()
        )
        await desk.press(*["backspace"] * 5, *"nonsense", "down", "enter")
        assert "nothing has that name" in str(desk.app.screen.query_one(".dialog-hint", Static).render())


async def test_the_list_follows_the_state_and_the_mark_stays():
    async with sitting(running()) as desk:
        await desk.press("colon", *"res")
        options = desk.app.screen.query_one(OptionList)
        assert "not now" in str(options.get_option_at_index(0).prompt)
        await desk.play(running("paused", command=0.0))
        assert "not now" not in str(options.get_option_at_index(0).prompt)
        assert options.highlighted == 0
        await desk.press("enter")
        assert desk.kinds() == ["resume"]


@pytest.mark.parametrize(
    ("typed", "screen"),
    [("leave", LeaveDialog), ("note", NoteDialog), ("keys", KeyHelp)],
    ids=["leave", "note", "keys"],
)
async def test_dialogs_open_from_it(typed, screen):
    async with sitting(running()) as desk:
        await desk.press("colon", *typed, "enter")
        assert isinstance(desk.app.screen, screen)


async def test_pages_and_the_stop_are_in_it():
    async with sitting(running()) as desk:
        await desk.press("colon", *"page time", "enter")
        assert desk.app.chosen == "time"
        await desk.press("colon", *"stop", "enter")
        assert desk.kinds() == ["stop"]


async def test_letters_of_keys_are_letters_in_its_field():
    async with sitting(running()) as desk:
        await desk.press("colon", *"dnq1", "question_mark")
        assert desk.app.screen.query_one(Input).value == "dnq1?"
        assert isinstance(desk.app.screen, Chooser)
