"""What an operator may ask of a run that is going on, in which states, and what the sequencer does then.

Nothing here commands a voltage: a step begins as any other does, by a ramp of the slew, and a pause is 0 V at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from rig.link.front_end_messages import Request, State

if TYPE_CHECKING:
    from rig.sequence.sequencer import Sequencer

MEASURING: frozenset[State] = frozenset({"hold", "sine", "free"})
RUNNING: frozenset[State] = MEASURING | {"proving", "tare", "ramp", "rest", "wait"}


def obey(run: Sequencer, request: Request, time: float) -> None:
    """Do what is asked, or say that it means nothing now. Notes, leases and the like are the controller's."""
    if request.kind == "stop":
        run.halt(time, "aborted", f"stopped by {request.text or 'the operator'}")
    elif request.kind in ASKED:
        states, act = ASKED[request.kind]
        if run.state in states:
            act(run, time)
        else:
            run.journal.say(time, "warning", f"{request.kind} ignored: it means nothing in state {run.state}")


def _pause(run: Sequencer, time: float) -> None:
    run.pause(time, "by the operator")
    run.journal.say(time, "info", f"paused in {run.place}: command 0 V")


def _resume(run: Sequencer, time: float) -> None:
    run.end_row(time)
    run.journal.say(time, "info", f"resumed: {run.place} is retaken")
    run.stand_still()  # 0 V once more: also a pause that was resumed in the same tick sends it
    run.begin(time)


def _accept(run: Sequencer, time: float) -> None:
    if time <= run.since:
        run.journal.say(time, "warning", f"accept ignored: {run.place} has only just begun")
        return
    run.journal.say(time, "info", f"{run.place} ended early on request, its data are kept")
    run.finish_step(time)


def _skip(run: Sequencer, time: float) -> None:
    if run.state == "wait":
        run.journal.say(time, "warning", f"the wait of {run.place} is broken off on request: {run.waits_for(time)}")
        run.leave_step(time)
        return
    run.journal.say(time, "warning", f"{run.place} is left out on request")
    run.journal.given_up.append(run.step.index)
    run.leave_step(time)


def _repeat(run: Sequencer, time: float) -> None:
    run.journal.say(time, "info", f"{run.place} is taken again from its beginning, on request")
    run.end_row(time, cut=True)
    run.begin(time)


def _back(run: Sequencer, time: float) -> None:
    before = next((i for i in range(run.position - 1, -1, -1) if run.steps[i].measures), None)
    if before is None:
        run.journal.say(time, "warning", f"back ignored: nothing was measured before {run.place}")
        return
    run.end_row(time, cut=True)
    run.position = before
    run.journal.say(time, "info", f"back to {run.place} on request: it and what follows is measured again")
    run.begin(time)


def _extend(run: Sequencer, time: float) -> None:
    longer = run.holding.extend()
    run.journal.say(time, "info", f"{run.place} may last {longer:g} s longer, on request")


def _bad(run: Sequencer, time: float) -> None:
    row = run.journal.void_last()
    if row is None:
        run.journal.say(
            time, "warning", "bad ignored: no step was measured to its end yet, or the last one is marked already"
        )
        return
    run.journal.given_up.append(row.index)
    where = f"{row.phase} at {row.command_voltage:g} V, {row.t_start:.2f} to {row.t_end:.2f} s"
    run.journal.say(time, "warning", f"marked bad by the operator: step {row.index + 1}, {where}; no fit takes it")


ASKED: Mapping[str, tuple[frozenset[State], Callable[[Sequencer, float], None]]] = MappingProxyType(
    {
        "pause": (RUNNING, _pause),
        "resume": (frozenset({"paused"}), _resume),
        "accept": (MEASURING, _accept),
        "skip": (MEASURING | {"wait"}, _skip),
        "repeat": (MEASURING | {"tare"}, _repeat),
        "back": (RUNNING - {"proving", "tare"}, _back),
        "extend": (frozenset({"hold"}), _extend),
        "bad": (RUNNING | {"paused"}, _bad),
    }
)
"""Kind -> the states in which it means something, and what it does."""
