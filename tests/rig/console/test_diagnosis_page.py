"""The diagnosis page: verdict, where, what, the next sweep; one key makes that a campaign, and starts no motor."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from rig.campaign.loading import load_campaign
from rig.console.app import ConsoleApp
from rig.console.diagnosing import DiagnosisPanel
from rig.console.next_run import NextRun
from rig.console.sweep_dialog import SweepDialog
from rig.console.view_model.answers import answer_of, levels_text, sweep_text
from rig.console.view_model.answers_text import answers_text
from rig.diagnose.next_from_answer import proposed_in
from rig.errors import ConfigError
from rig.link.front_end_messages import Request
from rig.link.processes import alive
from rig.operate.check import check_campaign
from tests.rig.console.feeds import campaign, running
from tests.rig.console.scenes import settle
from tests.rig.console.sitting import sitting
from tests.rig.console.told import EXPLAINED, LEVELS, ambiguous, message, speaker, unexplained

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"
END = replace(campaign()[-1], files=("run/T3.h5",))


def ended(folder: Path, *names: str):
    return replace(END, files=tuple(str(folder / name) for name in names))


async def diagnosed(desk) -> str:
    await desk.press("g")
    await settle(desk.pilot, lambda: not desk.app.doing)
    await desk.draw()
    return desk.text(DiagnosisPanel)


def test_an_answer_has_verdict_place_effects_with_intervals_and_what_is_left():
    answer = answer_of(("T1.h5",), message(EXPLAINED))
    (effect,) = answer.what
    value = EXPLAINED["findings"][0]["parameters"]["half_width"]
    assert (answer.mark, answer.verdict, answer.fault) == ("✓", "explained", "")
    assert effect.values == (f"half width {value['value']:.4f} V (95 %: {value['low']:.4f} to {value['high']:.4f})",)
    assert answer.where == tuple(each["statement"] for each in EXPLAINED["mismatch"])
    assert "before" in answer.error
    assert "after" in answer.error
    assert (answer.left, answer.sweep, answer.runs) == ("", None, False)


def test_a_sweep_in_words():
    sweep = answer_of(("T3.h5",), message(ambiguous())).sweep
    C = EXPLAINED["model"]["parameters"]["C"]["value"]
    assert levels_text(sweep) == "±5.4, ±16.2 V"
    assert sweep_text(sweep) == (
        f"6 steps, 18 s and tares: ±5.4, ±16.2 V; peak 16.2 V, about {C * 16.2**2:.3g} N; "
        "decides with a probability of 0.97"
    )
    two = answer_of(("T3.h5",), message(ambiguous(flows=(0.0, 0.5)))).sweep
    assert "flow 0, 0.5 m/s" in sweep_text(two)


@pytest.mark.parametrize("said", [{"answer": {}}, {"answer": None}, {}, {"fault": "no file\nhere"}])
def test_what_is_no_answer_is_a_sentence(said):
    answer = answer_of(("T3.h5",), said)
    assert answer.fault
    assert "\n" not in answer.fault
    assert not answer.runs


async def test_the_page_grows_answer_by_answer_verdict_first(tmp_path):
    async with sitting(ended(tmp_path, "T1.h5", "T3.h5"), size=(100, 60)) as desk:
        desk.app.begins = True
        desk.app.diagnose = speaker(tmp_path, {"at": "3 s, looking"}, message(ambiguous()))
        text = await diagnosed(desk)
    assert text.count("? AMBIGUOUS") == 2
    assert text.index("T1.h5") < text.index("T3.h5")
    for part in ("where", "winding resistance (BIC worse by 1.2)", "82 %", "before", "peak 16.2 V", "s asks for it"):
        assert part in text


async def test_progress_is_shown_and_escape_asks_once_then_ends(tmp_path):
    waits = 'import signal\nsignal.signal(signal.SIGINT, lambda *a: print(\'{"fault": "asked"}\', flush=True))\n'
    async with sitting(ended(tmp_path, "T1.h5", "T3.h5")) as desk:
        desk.app.diagnose = speaker(tmp_path, then=waits + "print('{\"at\": \"7 s, looking\"}', flush=True)\n"
                                                           "while True: time.sleep(0.05)")  # fmt: skip
        await desk.press("g")
        await settle(desk.pilot, lambda: "7 s, looking" in desk.app.doing)
        await desk.press("g")
        assert any("under way" in text for text in desk.toasts())
        await desk.press("escape")
        await settle(desk.pilot, lambda: bool(desk.app.answers))
        assert desk.app.answers[0].fault == "asked"
        assert desk.app.doing
        await desk.press("escape")
        await settle(desk.pilot, lambda: not desk.app.doing)
        assert [answer.files[0] for answer in desk.app.answers] == [str(tmp_path / "T1.h5")] * 2
        assert desk.app.answers[1].fault == "it was interrupted"


async def test_a_diagnosis_that_fails_is_one_sentence(tmp_path):
    async with sitting(ended(tmp_path, "T1.h5", "T3.h5")) as desk:
        desk.app.diagnose = speaker(tmp_path, then="sys.exit('Traceback\\n  many lines\\nMemoryError: none left')")
        text = await diagnosed(desk)
        assert "! NO ANSWER   T1.h5: MemoryError: none left" in text
        desk.app.diagnose = ("/no/such/program",)
        assert "can't be started: No such file" in await diagnosed(desk)


async def test_what_a_name_holds_is_shown_and_not_obeyed(tmp_path):
    async with sitting(ended(tmp_path, "T1.h5")) as desk:
        desk.app.diagnose = speaker(tmp_path, message({**unexplained("T\x1b[2J"), "notes": ["\x07note"]}))
        text = await diagnosed(desk)
    assert "\x1b" not in text
    assert "\\u001b[2J" in text
    assert "resembles exponent" in text


@pytest.mark.parametrize("snapshot", [running(), running("paused"), running("stopping"), running("run_done")])
async def test_while_something_may_turn_the_keys_do_nothing(tmp_path, snapshot):
    async with sitting(snapshot) as desk:
        desk.app.diagnose = speaker(tmp_path, message(ambiguous()))
        desk.app.answers = (answer_of(("run/T3.h5",), message(ambiguous())),)
        await desk.press("g", "s")
        await desk.pilot.pause(0.1)
        assert desk.kinds() == []
        assert not isinstance(desk.app.screen, SweepDialog)
        assert (desk.app.doing, desk.app.next_run) == ("", None)
        assert any("Once the campaign has ended" in text for text in desk.toasts())


async def asked(desk, folder, *answers) -> None:
    desk.app.diagnose = speaker(folder, *answers)
    await diagnosed(desk)
    await desk.press("s")
    await settle(desk.pilot, lambda: isinstance(desk.app.screen, SweepDialog))
    await desk.draw()


async def test_the_next_sweep_is_asked_for_written_beside_the_recordings_and_left_to_be_run(tmp_path):
    async with sitting(ended(tmp_path, "T1.h5")) as desk:
        desk.app.begins = True
        await asked(desk, tmp_path, message(ambiguous("T1"), str(RIGHT)))
        assert not list(tmp_path.glob("next*"))
        await desk.press("down", "enter")
        await settle(desk.pilot, lambda: not desk.app.is_running)
    file = tmp_path / "next-T1.toml"
    assert desk.app.next_run == NextRun(file, (str(tmp_path / "T1.h5"),))
    assert [s.voltage for s in load_campaign(file).plan if s.phase == "hold"] == list(LEVELS)
    assert check_campaign(file).peak_voltage == 16.2
    assert load_campaign(file).bench.path == load_campaign(RIGHT).bench.path
    assert desk.kinds() == []  # no start was asked for


@pytest.mark.parametrize("keys", [("escape",), ("enter",)])
async def test_nothing_is_written_unless_it_was_chosen(tmp_path, keys):
    async with sitting(ended(tmp_path, "T1.h5")) as desk:
        await asked(desk, tmp_path, message(ambiguous("T1"), str(RIGHT)))
        await desk.press(*keys)
        await desk.draw()
        assert not isinstance(desk.app.screen, SweepDialog)
        assert desk.app.next_run is None
    assert not list(tmp_path.glob("next*"))


async def test_a_console_that_did_not_start_the_run_says_what_to_type_and_overwrites_nothing(tmp_path):
    (tmp_path / "next-T1.toml").write_text("mine")
    async with sitting(ended(tmp_path, "T1.h5"), size=(140, 50)) as desk:
        await asked(desk, tmp_path, message(ambiguous("T1"), str(RIGHT)))
        await desk.press("tab", "enter")
        await settle(desk.pilot, lambda: bool(desk.app.written))
        await desk.draw()
        assert f"rig run {tmp_path / 'next-T1.2.toml'}" in desk.text(DiagnosisPanel).replace("\n", "")
        assert desk.app.is_running
    assert (tmp_path / "next-T1.toml").read_text() == "mine"


async def test_a_sweep_of_two_flow_speeds_is_two_campaigns(tmp_path):
    async with sitting(ended(tmp_path, "T1.h5")) as desk:
        desk.app.begins = True
        await asked(desk, tmp_path, message(ambiguous("T1", (0.0, 0.5)), str(RIGHT)))
        await desk.press("down", "enter")
        await settle(desk.pilot, lambda: not desk.app.is_running)
    assert desk.app.next_run.campaign == tmp_path / "next-T1-1.toml"
    assert desk.app.next_run.others == (tmp_path / "next-T1-2.toml",)
    assert load_campaign(desk.app.next_run.others[0]).flow_speed == 0.5


async def test_what_the_campaign_refuses_is_said(tmp_path):
    async with sitting(ended(tmp_path, "T9.h5")) as desk:
        await asked(desk, tmp_path, message(ambiguous("T9"), str(RIGHT)))
        await desk.press("down", "enter")
        await settle(desk.pilot, lambda: any("T9" in text for text in desk.toasts()))
    assert not list(tmp_path.glob("next*"))


async def test_without_a_campaign_the_sweep_is_shown_and_not_offered(tmp_path):
    async with sitting(ended(tmp_path, "T1.h5"), size=(100, 50)) as desk:
        desk.app.diagnose = speaker(tmp_path, message(ambiguous("T1"), "", "there is no ledger"))
        text = await diagnosed(desk)
        assert "peak 16.2 V" in text
        assert "there is no ledger" in text
        await desk.press("s")
        assert any("g diagnoses" in toast for toast in desk.toasts())


async def test_a_console_that_looks_on_writes_nothing(tmp_path):
    async with sitting(replace(ended(tmp_path, "T1.h5"), clients=2)) as desk:
        desk.app.answers = (answer_of(("T1.h5",), message(ambiguous("T1"), str(RIGHT))),)
        await desk.press("s")
        assert any("Press l to attend" in toast for toast in desk.toasts())


async def test_what_the_sweep_records_is_diagnosed_with_what_proposed_it(tmp_path):
    async with sitting(ended(tmp_path, "T1.h5")) as desk:
        desk.app.earlier = ("first/T1.h5",)
        desk.app.diagnose = speaker(tmp_path, message(EXPLAINED))
        assert "T1.h5 + T1.h5" in await diagnosed(desk)
        assert desk.app.answers[0].files == ("first/T1.h5", str(tmp_path / "T1.h5"))


@pytest.mark.parametrize("opened", [(), ("s",)])
async def test_the_stop_key_goes_out_at_once_while_a_diagnosis_is_under_way_and_in_the_dialog(tmp_path, opened):
    async with sitting(ended(tmp_path, "T3.h5")) as desk:
        desk.app.answers = (answer_of(("T3.h5",), message(ambiguous())),) if opened else ()
        if not opened:
            talk = 'while True: print(\'{"at": "looking"}\', flush=True)'
            desk.app.diagnose = speaker(tmp_path, then=talk)
            await desk.press("g")
            await settle(desk.pilot, lambda: "looking" in desk.app.doing)
        await desk.press(*opened)
        for key in ("ctrl+c", "f9"):
            before = len(desk.kinds())
            desk.app.simulate_key(key)
            assert desk.kinds()[before:] == ["stop"]  # no turn of the event loop
            assert desk.feed.sent[-1] == Request("stop", "console")


async def test_leaving_ends_the_process_that_diagnoses(tmp_path):
    told = tmp_path / "pid"
    async with sitting(ended(tmp_path, "T3.h5")) as desk:
        desk.app.diagnose = speaker(
            tmp_path,
            then=f"import os, pathlib\npathlib.Path({str(told)!r}).write_text(str(os.getpid()))\ntime.sleep(60)",
        )
        await desk.press("g")
        await settle(desk.pilot, lambda: told.exists() and bool(told.read_text()))
        await desk.press("d")
        await settle(desk.pilot, lambda: not desk.app.is_running)
    assert not alive(int(told.read_text()))


def test_the_real_process_ends_with_the_input_of_a_console_that_was_killed(tmp_path):
    """Waits in an endless answer: nothing of it is asked of the diagnosis."""
    code = (
        "import os, time\nfrom rig.diagnose.beside_console import end_with_input\n"
        "end_with_input()\nprint(os.getpid(), flush=True)\ntime.sleep(60)"
    )
    read, write = os.pipe()
    pid = os.posix_spawn(sys.executable, [sys.executable, "-c", code], os.environ,
                         file_actions=[(os.POSIX_SPAWN_DUP2, read, 0), (os.POSIX_SPAWN_CLOSE, write)])  # fmt: skip
    os.close(read)
    os.close(write)
    begun = time.monotonic()
    while not os.waitpid(pid, os.WNOHANG)[0]:
        time.sleep(0.05)
        if time.monotonic() - begun > 30:
            os.kill(pid, signal.SIGKILL)
            pytest.fail("it went on without its console")


def test_a_console_of_its_own_begins_nothing_unless_told():
    assert not ConsoleApp(None, time.monotonic).begins


def test_a_doubt_that_no_sweep_settles_says_what_else_would():
    why = "within these limits asymmetry is like torque_crosstalk (dead weights on the cell would tell)"
    told = {**ambiguous("T3"), "next_experiment": {"why": why, "steps": [], "expected_power": 0.0}}
    answer = answer_of(("T3.h5",), message(told))
    assert not answer.fault
    assert answer.sweep is None
    assert not answer.runs
    console = Console(width=200)
    with console.capture() as shown:
        console.print(answers_text([answer], ""))
    assert f"no sweep settles it: {why}" in shown.get()
    with pytest.raises(ConfigError, match="no sweep settles it"):
        proposed_in(told)
