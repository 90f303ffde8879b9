"""The motor's telemetry hangs, or the motor does not do what it is told: a run over real bytes ends, and in time."""

from __future__ import annotations

import time

import pytest

from tests.reliability.live import attach, live_bench, turning

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
PUBLISHED = 0.1
"""s between snapshots."""


@pytest.mark.parametrize(
    ("fault", "within", "cause", "confirmed"),
    [
        ("frozen", 1.0, "the telemetry of motor is frozen", False),
        ("over_temperature", 0.2, "motor reports fault 6 (over-temperature motor)", True),
        # it lets go after 0.5 s and coasts: seen by its current or its rotation, or after 1 s of driving at rest
        ("ignores_commands", 4.0, "the motor does not follow|contradict: the", True),
    ],
)
def test_motor_that_lies_ends_the_run(tmp_path, report, prompt, fault, within, cause, confirmed):
    with live_bench(tmp_path) as bench:
        front = attach(bench.start(dwell=6.0))
        front.begin(turning(10.0, 1.5))  # what is frozen is known by the noise that it had
        bench.tell("fault", "motor", fault)
        begun = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        front.until(lambda s: s.state in ("stopping", "run_done", "done"))
        latency = (time.monotonic_ns() - begun) * 1e-9
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert any(each in last.cause for each in cause.split("|"))
        assert last.stop_confirmed is confirmed
        report(f"motor {fault} to command 0", latency, "s")
        prompt(latency, within + 2 * PUBLISHED + 0.1, begun)
