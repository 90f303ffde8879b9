"""One run of one thruster into one file: open it, run the sequencer until the propeller's rest is known, close it."""

from __future__ import annotations

from collections.abc import Iterable, Set
from dataclasses import replace

from identification.recording import VOID
from rig.campaign.bench import Bench
from rig.campaign.plan import TARE_AGAIN, Step
from rig.control.loop import Decision, Inputs
from rig.control.status import Held, Status
from rig.link.recorder_messages import Outcome, StepRow
from rig.recording.ledger import Fact, attempts, kept_steps
from rig.recording.recorder_link import recording_path
from rig.safety.thrust_rest import ThrustRest
from rig.sequence.sequencer import Sequencer
from rig.sequence.ticks import Output, Tick, by_thrust, settings_for
from rig.stages.recording_header import opening
from rig.stages.session import Session, Stopped
from rig.stages.watching import begin_watch, end_watch, hear_watch


def measure(session: Session) -> None:
    """Raises Stopped when the run did not complete, LinkError when the recorder fails."""
    status, loop = session.status, session.loop
    thruster = status.thruster
    status.outcome, status.cause, status.stop_confirmed = "running", "", None
    session.measured.clear()
    session.given_up.clear()
    path = recording_path(session.folder, thruster)
    attempt = attempts(session.before, thruster) + 1
    kept = kept_steps(session.before, thruster)
    session.kept = frozenset(kept["steps"] if kept else ())
    t0_ns, stamp = loop.clock.now_ns(), session.stamp()
    continues = kept["continues"] if kept else ""
    request = opening(session.campaign, session.bench, thruster, path, t0_ns, stamp, attempt, continues)
    session.recorder.open(request, loop.now)
    loop.clients.clear_trace()
    loop.forget_tare()
    loop.begin_recording(t0_ns)
    begin_watch(session, thruster, t0_ns)  # before the first row is recorded
    status.files.append(str(path))
    session.wait_for_recorder(lambda: session.recorder.ready, f"open {path}")
    session.event_log.begin(t0_ns)
    steps = session.campaign.plan.after(session.kept)
    if attempt > 1:
        session.say("info", f"attempt {attempt} of {thruster}: {_where(steps, kept)}")
    session.ledger.write(
        "run_start", thruster=thruster, recording=str(path), recording_t0_ns=t0_ns, attempt=attempt,
        recording_id=stamp.recording_id,
    )  # fmt: skip
    # nothing is measured into a file that the ledger may never name
    session.wait_holding(lambda: session.ledger.settled, f"{session.ledger.path} to take that the run begins")
    settings = replace(settings_for(session.campaign, thruster), proved=session.proved)
    if loop.rest_by_thrust is not None:
        settings = by_thrust(settings, loop.rest_by_thrust.thrust)
    _close(session, sequence(session, Sequencer(steps, settings), t0_ns))


def _where(steps: tuple[Step, ...], kept: Fact | None) -> str:
    """Where a run that was cut goes on."""
    first = next((step for step in steps if step.index >= 0), None)
    if kept is None or first is None:
        return "the run is repeated from its first tare"
    return (
        f"it goes on at step {first.number} ({first.phase}) after a tare; the steps before are in "
        f"{', '.join(kept['recordings'])}"
    )


def sequence(session: Session, sequencer: Sequencer, t0_ns: int) -> Output:
    """Ticks until the sequencer is done, also through a stop until the propeller's rest is known."""
    loop, status = session.loop, session.status
    begun = loop.now
    begun_ns = round(begun * 1e9)
    cool = session.campaign.plan.cool_down
    tares = frozenset(step.index for step in session.campaign.plan if step.phase == "tare") | {TARE_AGAIN}

    def decide(inputs: Inputs) -> Decision:
        since_begun = inputs.now - begun
        thrust = loop.thrust_rows(inputs.samples, begun_ns)
        trip = replace(inputs.trip, time=since_begun) if inputs.trip else None
        degrees = None if cool is None else loop.readings.fresh(cool.channel, inputs.now)
        tick = Tick(
            since_begun, thrust, inputs.rotation, inputs.thrust_rest, inputs.push, inputs.current_rest, degrees, trip,
            inputs.requests,
        )  # fmt: skip
        output = sequencer.advance(tick)
        _tell_tare(loop.thrust_rest, output, tares)
        _take(session, output, t0_ns, begun)
        hear_watch(session)
        session.note(inputs.requests)
        return Decision(output.volts, output.release)

    status.output = None
    while status.output is None or not status.output.done:
        loop.tick(session.motor, decide)
    return status.output


def _tell_tare(witness: ThrustRest, output: Output, tares: Set[int]) -> None:
    """What the sequencer found out about the zero of the thrust; a tare that was not stable or was cut is `free`."""
    if output.tare is not None:
        witness.tared(output.tare)
    if any(row.index in tares and row.phase == "free" for row in output.rows):
        witness.doubt()


def _take(session: Session, output: Output, t0_ns: int, begun: float) -> None:
    """Show and record what the sequencer finished in this tick; its times are s since `begun`."""
    status, offset = session.status, begun - t0_ns * 1e-9
    output = _as_told(output, session.bench)
    status.take(output)
    if output.outcome in ("aborted", "tripped"):
        status.outcome, status.cause = output.outcome, output.cause
    status.stop_confirmed = output.stop_confirmed
    status.points.extend(output.points)
    for row in output.rows:
        start, end = row.t_start + offset, row.t_end + offset
        session.recorder.step(StepRow(row.index, row.phase, row.command_voltage, start, end))
        session.measured.add((row.index, row.phase))
        if row.index >= 0 and row.phase in ("hold", "sine", "rest", "tare"):
            status.held.append(Held(row.index, row.command_voltage, start, end))
        if row.phase == VOID:
            _forget_point(status, row.index)
        session.ledger.write("step", thruster=status.thruster, index=row.index, phase=row.phase, t_end=end)
    session.given_up.update(output.given_up)
    for line in output.events:
        session.event_log.say(round((begun + line.time) * 1e9), line.level, line.text)


def _as_told(output: Output, bench: Bench) -> Output:
    """With the levels that the motor controller was really told: a plan has 5 V where a controller of thousandths of
    48 V has 4.992 V, and C goes with their square."""
    if not (output.rows or output.points):
        return output
    rows = [replace(row, command_voltage=bench.told(row.command_voltage)) for row in output.rows]
    points = [replace(point, voltage=bench.told(point.voltage)) for point in output.points]
    return output._replace(rows=tuple(rows), points=tuple(points))


def _forget_point(status: Status, step: int) -> None:
    """Of the step that was marked bad, the newest one."""
    for place in range(len(status.points) - 1, -1, -1):
        if status.points[place].step == step:
            del status.points[place]
            return


def _close(session: Session, output: Output) -> None:
    """Close the file in order and tell the ledger; a run that did not complete ends the campaign."""
    status, recorder, loop = session.status, session.recorder, session.loop
    _last_words(session)
    end_watch(session)
    outcome, cause = judged(session, output)
    session.event_log.end()
    recorder.close_file(outcome, cause)
    loop.end_recording()
    loop.guarded = False
    session.wait_for_recorder(lambda: recorder.closed is not None or bool(recorder.failed), "close the file")
    if recorder.failed and outcome == "completed":
        outcome, cause = "aborted", f"recorder: {recorder.failed}"
    session.ledger.write(
        "run_end", thruster=status.thruster, outcome=outcome, cause=cause, recording=status.files[-1],
        sha256=recorder.closed.sha256 if recorder.closed else "", time_to_zero_s=output.time_to_zero_s,
    )  # fmt: skip
    if outcome != "completed":
        raise Stopped(outcome, cause)
    if output.time_to_zero_s is not None and not session.proved:
        session.proved = True
        text = f"watchdog proved in the run of {status.thruster}: at rest {output.time_to_zero_s:.2f} s after silence"
        session.say("info", text, of_bench=True)
    loop.begin_guarding()


def judged(session: Session, output: Output) -> tuple[Outcome, str]:
    """Outcome and cause of a run that is over. Completed is only what measured every step and came to rest."""
    if output.outcome in ("aborted", "tripped"):
        return output.outcome, output.cause
    plan = [step for step in session.campaign.plan if step.index not in session.kept | session.given_up]
    missing = missing_steps(plan, session.measured, {point.step for point in session.status.points})
    if missing:
        return "aborted", f"the plan is not measured whole: step {missing[0].number} ({missing[0].phase}) has no data"
    if not output.stop_confirmed:
        return "tripped", "STOP NOT CONFIRMED at the end of the run: nothing is mounted on a propeller that may turn"
    return "completed", ""


def missing_steps(plan: Iterable[Step], measured: Set[tuple[int, str]], points: Set[int]) -> list[Step]:
    """Steps that a run which says it is completed has not measured (docs/reliability.md, promise 27).

    A hold needs its point; a tare, sine or swept ramp needs to have run to its end. A later tare that was not stable
    leaves the one before in use: that it was tried is enough.
    """
    steps = list(plan)

    def ran(step: Step) -> bool:
        tried = step.phase == "tare" and step.index > 0 and (step.index, "free") in measured
        return tried or (step.index, step.phase) in measured

    return [
        step
        for step in steps
        if (step.phase == "hold" and step.index not in points)
        or ((step.phase in ("tare", "sine") or step.swept) and not ran(step))
    ]


def _last_words(session: Session) -> None:
    """What an analyst should know of the wires and of the loop, at the end of the file."""
    for name, instrument in session.bench.instruments.items():
        health = instrument.health()
        if health.bad:
            first = "; ".join(health.first_bad)
            text = f"{name}: {health.bad} of {health.received} frames could not be understood, first: {first}"
            session.say("warning", text)
        if health.dropped:
            session.say("warning", f"{name}: {health.dropped} frames were lost: the loop did not take them in time")
    consistency = session.loop.motor_watch.consistency
    if learnt := consistency.told():
        session.say("info", f"learnt: {learnt}")
    for doubt in consistency.doubts(session.campaign.expected_C):
        session.say("warning", doubt)
    session.say("info", f"control loop: {session.loop.late}")
