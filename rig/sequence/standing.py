"""What a run does at 0 V in a tick: a tare, a rest, a wait.

Each answers True when the state has changed: the new one is asked in this same tick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.safety.stopping import is_rest, pushes_nothing, turning, without_a_rate
from rig.sequence.ticks import EPSILON, Tick

if TYPE_CHECKING:
    from rig.sequence.sequencer import Sequencer


def take_tare(run: Sequencer, tick: Tick) -> bool:
    """The first tare must be stable; a later one that is not leaves the one before in use."""
    verdict, mean, text = run.taring.advance(tick.time, tick.thrust)
    match verdict:
        case "waiting":
            return False
        case "accepted":
            run.tare = mean
            run.journal.say(tick.time, "info", text)
            run.next_step(tick.time)
        case "failed" if run.tare is None:
            run.halt(tick.time, "tripped", text)
        case _:
            kept = f"; the last tare of {run.tare:.4f} N stays in use" if verdict == "failed" else ""
            run.journal.say(tick.time, "warning", text + kept)
            run.end_row(tick.time, cut=True)
            run.since = tick.time
            if verdict == "failed":
                run.next_step(tick.time)
    return verdict != "again"


def rest(run: Sequencer, tick: Tick) -> bool:
    step = run.step
    elapsed, blind = tick.time - run.since + EPSILON, run.settings.without_rate
    if blind:
        at_rest = pushes_nothing(tick.thrust_rest, tick.current_rest)
    else:
        at_rest = is_rest(tick.rotation, run.settings.rest_rate)
    if elapsed >= step.max_duration or (elapsed >= step.min_duration and at_rest and not blind):
        if not at_rest:
            what = motion(run, tick) if blind else turning(tick.rotation)
            run.journal.say(tick.time, "warning", f"not at rest after {elapsed:.1f} s at 0 V: {what}")
        run.next_step(tick.time)
        return True
    return False


def motion(run: Sequencer, tick: Tick) -> str:
    """What is known of the rotation, in words."""
    if run.settings.without_rate:
        return without_a_rate(tick.thrust_rest, tick.current_rest)
    return turning(tick.rotation, tick.thrust_rest)


def wait(run: Sequencer, tick: Tick) -> bool:
    """0 V until the water has settled and the motor is cool; what does not cool down ends the run, or asks."""
    verdict = run.waiting.advance(tick.time, tick.temperature)
    if verdict == "over":
        run.journal.say(tick.time, "info", f"waited {tick.time - run.since:.1f} s{run.waiting.found}")
        run.next_step(tick.time)
    elif verdict == "failed":
        _not_cool(run, tick.time, run.waiting.failure(tick.time))
    return verdict == "over"


def _not_cool(run: Sequencer, time: float, cause: str) -> None:
    wait = run.step.wait
    if run.settings.attended and wait is not None and wait.cool is not None and wait.cool.otherwise == "ask":
        run.pause(time, cause)
        run.journal.say(time, "warning", f"paused in {run.place}: {cause}; resume waits once more")
    else:
        run.halt(time, "tripped", cause)
