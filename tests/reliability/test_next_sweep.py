"""From a campaign's end to the next sweep in one terminal, by keys alone: what turns, by the bench's truth log."""

from __future__ import annotations

import json
import time

import pytest

from rig.campaign.loading import load_campaign
from tests.reliability.live import NOT_PROVED, LiveBench, live_bench
from tests.reliability.live_campaign import CAMPAIGN
from tests.rig.console.terminal import Terminal, on_terminal
from tests.rig.console.told import ambiguous, message, speaker

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(300)]

F5, DOWN, ENTER, TAB = b"\x1b[15~", b"\x1b[B", b"\r", b"\t"
CODE = """import json, sys
from rig.cli import entry
from rig.console.app import ConsoleApp
ConsoleApp.__init__.__defaults__ = ("rig console", json.loads(sys.argv.pop(1)))  # diagnoses in no time
entry()"""
READY = "Press F5 to start"


def commands(bench: LiveBench) -> list[float]:
    """Each that the drive was given and that is not 0."""
    return [line["value"] for line in bench.truth() if line["event"] == "command" and line["value"]]


def until_after(screen: Terminal, mark: str, text: str) -> None:
    """Wait until `text` has been drawn after `mark`."""
    deadline = time.monotonic() + 60.0
    while text not in screen.lines.partition(mark)[2]:
        assert time.monotonic() < deadline, screen.lines[-3000:]
        time.sleep(0.1)


def test_s_leads_to_the_preflight_of_the_sweep_and_only_f5_turns_the_motor(tmp_path):
    campaign = tmp_path / "campaign.toml"
    text = CAMPAIGN.format(unattended="false", prove="false", dwell=1.0, thrusters='["T1"]')
    campaign.write_text(text.replace("10.0, -10.0, 6.0, -6.0", "10.0, -10.0") + NOT_PROVED)
    says = json.dumps(speaker(tmp_path, message(ambiguous("T1"), str(campaign))))
    with live_bench(tmp_path) as bench, on_terminal(CODE, says, "run", str(campaign)) as (process, screen):
        screen.until(READY.encode())
        screen.press(F5)
        screen.until(b"COMPLETED")
        screen.press(b"g")
        screen.until(b"AMBIGUOUS")
        screen.press(b"s")
        screen.until(b"Run the sweep of T1")
        before = commands(bench)
        assert before
        screen.press(DOWN + ENTER)
        screen.until(b"next: /")
        screen.press(F5 * 3)  # while no console is there
        until_after(screen, "next: /", READY)
        (sweep,) = (tmp_path / "out").glob("*/next-T1.toml")
        assert load_campaign(sweep).thrusters == ("T1",)
        time.sleep(3.0)
        assert commands(bench) == before
        screen.press(F5)
        bench.until_held(5.4, 0.5)
        screen.press(b"\x03")
        until_after(screen, "next: /", "ABORTED")
        screen.press(b"d")
        process.wait(60)
    assert len(list((tmp_path / "out").iterdir())) == 2
