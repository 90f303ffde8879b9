"""Promise 12, live: an emergency stop's contact on a port of its own, pressed while the propeller turns, and its cable
pulled, by the truth log of a bench in another process."""

from __future__ import annotations

import pytest

from tests.reliability.live import PATIENCE, SLACK, TICK, at_rest, attach, live_bench, patient, turning, zero_after

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
RATE = 50.0
"""lines/s of the button."""
BUTTON = f"""
[devices.button]
kind = "line_stream"
port = "ports/button"
pattern = '(?P<value>[01])'
quantity = "emergency_stop"
unit = "1"
rate = {RATE}
line_characters = 3
scale = -1.0
offset = 1.0

[limits."button.emergency_stop"]
max_age = {PATIENCE}
"""


def world(text: str) -> str:
    return f'{text}\n[devices.button]\nkind = "button"\nport = "button"\nrate = {RATE}\n'


def bench_file(text: str) -> str:
    return patient(text) + BUTTON


@pytest.mark.parametrize(
    ("fault", "limit", "cause"),
    [
        ("pressed", 1 / RATE + 2 * TICK + SLACK, "EMERGENCY STOP: button.emergency_stop is 1"),
        ("silent", PATIENCE + 2 * TICK + SLACK, "button.emergency_stop is stale"),
        ("pulled", PATIENCE + 2 * TICK + SLACK, "button"),
    ],
)
def test_the_propeller_stops(tmp_path, report, prompt, fault, limit, cause):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start())
        front.begin(turning(10.0))
        bench.tell("fault", "button", fault)
        pressed = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert cause in last.cause
        latency = zero_after(bench.truth(), pressed)
        report(f"emergency stop {fault}, live, to 0 V", latency, "s")
        prompt(latency, limit, pressed)
        assert at_rest(bench)
