"""What the operator can do, and what the console says: start, pause, note, leave, attach late, disconnect, resize."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rig.console.dialogs import LeaveDialog
from rig.console.panels import ChecksPanel, ProgressPanel, ReadingsPanel, ResultsPanel
from rig.link.front_end_messages import LogLine, Request
from tests.rig.console.feeds import CHECKS, LOG, campaign, points, running, snapshot
from tests.rig.console.sitting import sitting


async def test_f5_starts_from_the_preflight_list_and_nothing_else_does():
    async with sitting(snapshot("preflight")) as desk:
        assert "Press F5 to start" in desk.text(ChecksPanel)
        await desk.press("enter", "space", "s", "r")
        assert "start" not in desk.kinds()
        await desk.press("f5")
        assert desk.kinds()[-1] == "start"


async def test_a_failed_check_is_said_in_words():
    failed = (*CHECKS[:-1], replace(CHECKS[-1], verdict="failed"))
    async with sitting(snapshot("preflight", checks=failed)) as desk:
        assert "FAILED" in desk.text(ChecksPanel)
        assert "1 of 7 checks FAILED" in desk.text(ChecksPanel)


async def test_a_start_that_was_refused_is_said_where_it_was_asked_for():
    failed = (*CHECKS[:-1], replace(CHECKS[-1], verdict="failed", text="off"))
    log = (
        LogLine(3.0, "warning", "not started: flow: no rows", -1),
        LogLine(9.4, "warning", "not started: watchdog: off", -1),
    )
    async with sitting(snapshot("preflight", checks=failed)) as desk:
        assert "F5" not in desk.text("#keys")
        await desk.play(snapshot("preflight", checks=failed, log=log, log_count=2))
        assert "9.4 s: not started: watchdog: off" in desk.text(ChecksPanel)
        assert "no rows" not in desk.text(ChecksPanel)
        await desk.play(snapshot("preflight", log=log, log_count=2))
        assert "not started" not in desk.text(ChecksPanel)
        assert "F5" in desk.text("#keys")


async def test_f5_says_that_the_thruster_is_mounted():
    async with sitting(running("mount", thruster="T3", mounted_by_hand=True)) as desk:
        assert "Put T3 on the bench" in desk.alarm()
        assert "F5 mounted" in " ".join(desk.text("#keys").split())
        await desk.press("f5")
        assert desk.kinds() == ["mounted"]


async def test_a_thruster_that_a_command_mounts_is_not_asked_of_the_operator():
    async with sitting(running("mount", thruster="T3")) as desk:
        assert desk.alarm() == ""
        assert "F5" not in desk.text("#keys")


async def test_while_devices_are_opened_nobody_is_told_to_start():
    async with sitting(snapshot("connecting")) as desk:
        assert "F5" not in desk.text(ChecksPanel)


async def test_a_controller_that_ends_after_its_campaign_is_no_alarm():
    async with sitting(campaign()[-1]) as desk:
        await desk.lose()
        assert "COMPLETED. Propeller measured at rest." in desk.alarm()
        assert "as it should" in desk.text(".head-state")


async def test_f5_during_a_hold_asks_for_nothing():
    async with sitting(running()) as desk:
        await desk.press("f5")
        assert desk.kinds() == []


async def test_pause_resume_skip():
    async with sitting(running()) as desk:
        await desk.press("p")
        await desk.play(running("paused", command=0.0))
        assert "PAUSED at 0 V" in desk.alarm()
        await desk.press("r", "k")
        assert desk.kinds() == ["pause", "resume", "skip"]


async def test_a_note_may_contain_every_letter_that_is_a_key_elsewhere():
    async with sitting(running()) as desk:
        await desk.press("n", *"pdk1", "space", "n", "enter")
        assert Request("note", "pdk1 n") in desk.feed.sent
        assert desk.kinds() == ["note"]


@pytest.mark.parametrize("keys", [("escape",), ("a", "escape"), ("enter",), ("space", "enter")])
async def test_a_note_dropped_or_empty_is_not_sent(keys):
    async with sitting(running()) as desk:
        await desk.press("n", *keys)
        assert desk.kinds() == []
        assert len(desk.app.screen_stack) == 1


async def test_leases_go_out_while_connected_and_not_after():
    async with sitting(running()) as desk:
        assert Request("lease") in desk.feed.sent
        await desk.lose()
        before = len(desk.feed.sent)
        desk.app.renew_lease()
        assert len(desk.feed.sent) == before


async def test_leaving_an_unattended_campaign_says_that_it_goes_on_and_how_to_come_back():
    async with sitting(running(attended=False)) as desk:
        await desk.press("d")
        dialog = desk.app.screen
        assert isinstance(dialog, LeaveDialog)
        words = " ".join(str(widget.render()) for widget in dialog.query("Static"))
        assert "goes on without this console" in words
        assert "rig console recordings/run" in words
        await desk.press("tab", "enter")
        assert desk.kinds() == ["detach"]
        desk.clock.now += 0.6
        desk.feed.play(running(t=48.0))
        await desk.pilot.pause()
    assert not desk.app.is_running
    assert desk.app.parting is not None


async def test_escape_stays():
    async with sitting(running()) as desk:
        await desk.press("ctrl+q", "escape")
        assert desk.kinds() == []
        assert desk.app.parting is None


async def test_enter_at_once_in_the_leave_dialog_stays():
    async with sitting(running(attended=True)) as desk:
        await desk.press("d", "enter")
        assert desk.kinds() == []


async def test_a_refused_detach_keeps_the_console_and_its_leases():
    async with sitting(running(attended=True, clients=1)) as desk:
        await desk.play(running(t=47.5, attended=True, clients=2))
        await desk.press("d", "tab", "enter")
        no = LogLine(48.0, "warning", "detach refused: the campaign is attended and nobody else is here")
        await desk.play(running(t=48.0, attended=True, log=(*LOG, no), log_count=len(LOG) + 1))
        assert desk.app.is_running
        assert desk.app.parting is None
        assert no.text in desk.toasts()


async def test_leaving_an_attended_campaign_stops_it_and_waits_for_rest():
    async with sitting(running(attended=True)) as desk:
        await desk.press("d", "tab", "enter")
        assert desk.kinds() == ["stop"]
        await desk.play(running("stopping", attended=True, command=0.0))
        assert desk.app.is_running
        await desk.play(running("done", attended=True, command=0.0, outcome="aborted", stop_confirmed=False))
        assert "STOP NOT CONFIRMED" in desk.alarm()


async def test_a_lost_controller_never_looks_live():
    async with sitting(running(), size=(120, 40)) as desk:
        assert "LIVE" in desk.text(".head-state")
        await desk.lose()
        await desk.wait(14.0)
        assert "DISCONNECTED" in desk.alarm()
        assert "LIVE" not in desk.text(".head-state")
        readings = desk.text(ReadingsPanel)
        assert " ok" not in readings
        assert "sent" not in readings
        assert "14.0 s" in readings
        assert readings.count("OLD") == 15


async def test_silence_is_no_fresh_data_and_ends_with_the_next_snapshot():
    async with sitting(running()) as desk:
        await desk.wait(1.2)
        assert "NO FRESH DATA for 1.20 s" in desk.alarm()
        await desk.play(running(t=48.5))
        assert desk.alarm() == ""


async def test_keys_after_the_controller_has_gone_say_so_and_leave_works():
    async with sitting(running()) as desk:
        await desk.lose()
        await desk.press("p")
        assert any("gone" in text for text in desk.toasts())
        await desk.press("d")
        await desk.pilot.pause()
    assert not desk.app.is_running


async def test_stale_and_limit_are_words():
    first, second, third, *rest = running().readings
    readings = (replace(first, state="stale"), replace(second, state="limit"), replace(third, state="none"), *rest)
    async with sitting(running(readings=readings)) as desk:
        text = desk.text(ReadingsPanel)
        assert all(word in text for word in ("STALE", "LIMIT", "no data"))
        assert "CHECK: load_cell.thrust STALE, load_cell.stable LIMIT" in desk.alarm()


async def test_the_end_shows_a_row_per_thruster_and_the_files():
    async with sitting(*campaign()) as desk:
        text = desk.text(ResultsPanel)
        assert "completed" in text
        for word in ("T1", "T3", "2026-11-21_1502_T1.h5", "2026-11-21_1506_T3.h5"):
            assert word in text
        await desk.press("2", "1", "5")
        assert "T1" in desk.text(ResultsPanel)


async def test_attached_late_it_says_what_it_has_not_seen():
    end = replace(campaign()[-1], points=points("T3", 14))
    async with sitting(end) as desk:
        assert "1 more recordings were made before this console attached" in desk.text(ResultsPanel)


async def test_progress_in_words():
    async with sitting(running()) as desk:
        text = desk.text(ProgressPanel)
        assert "1 of 2" in text
        assert "19 %" in text
        assert "4:01 left" in text
        assert "step  24 of 31" in text


async def test_markup_in_what_others_wrote_is_text():
    odd = running(campaign="[red]tunnel[/", log=(LogLine(1.0, "info", "note: [bold]x[/y]"),), log_count=1)
    async with sitting(odd, size=(120, 40)) as desk:
        assert "[red]tunnel[/" in desk.text(".head-state")
        assert "note: [bold]x[/y]" in desk.text("#log")


@pytest.mark.parametrize("scene", ["preflight", "hold", "done"])
async def test_survives_every_size(scene):
    shots = {"preflight": snapshot("preflight"), "hold": running(), "done": campaign()[-1]}
    async with sitting(shots[scene]) as desk:
        for size in ((120, 40), (80, 24), (20, 6), (200, 60), (1, 1), (80, 24)):
            await desk.pilot.resize_terminal(*size)
            for key in "12345":
                await desk.press(key)
                await desk.glance()
        assert desk.app.is_running
