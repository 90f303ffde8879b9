"""One campaign on an open bench: connect, preflight, then mount and run each thruster; ends with the motor at rest.

Stages run one after another; each is a loop of ticks. Whatever happens, the last thing done to the motor is 0 V and release.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Literal

from drivers.errors import LinkError as WireError
from drivers.protocols import MotorController
from rig.bench import Bench, build
from rig.clients import Clients
from rig.config import CampaignConfig
from rig.errors import DeviceError, LinkError, RigError
from rig.ledger import Ledger
from rig.link import listen, remove, socket_path
from rig.loop import IDLE, Decision, Inputs, Loop, MonotonicClock
from rig.messages import LogLine, Request
from rig.opening import opening
from rig.preflight import all_checks, device_checks
from rig.readings import Readings
from rig.recorder_link import RecorderLink, recording_path
from rig.recorder_messages import EventRow, StepRow
from rig.sequencer import Sequencer
from rig.status import Status
from rig.ticks import Output, Tick, settings_for

Level = Literal["info", "warning", "trip", "error"]

SOCKET_NAME = "controller.sock"
SETTLE_ROWS = 5
"""Rows of the slowest stream that are waited for before the preflight judges rates."""
RECORDER_WAIT = 20.0
"""s for the recorder to open or close a file."""
FAREWELL = 3.0
"""s that the final snapshot is shown to front ends before the process ends."""


class Stopped(Exception):
    """The campaign is over before its plan is: an operator, a signal or the guard said so."""

    def __init__(self, outcome: Literal["aborted", "tripped"], cause: str) -> None:
        super().__init__(cause)
        self.outcome = outcome


class CampaignRun:
    """Owns bench, recorder link, front ends and loop for the life of one campaign."""

    def __init__(self, campaign: CampaignConfig, folder: Path, thrusters: tuple[str, ...]) -> None:
        self.campaign = campaign
        self.folder = folder
        self.status = Status(campaign, thrusters or campaign.thrusters)
        self.ledger = Ledger.open(folder)
        self.bench: Bench = build(campaign.bench)
        self.motor: MotorController | None = None
        log = (folder / "recorder.log").open("ab")
        self.recorder = RecorderLink.start(log)
        log.close()
        readings = Readings({stream.name: stream for _, stream in self.bench.streams()}, campaign.bench.limits)
        clients = Clients(listen(socket_path(folder, SOCKET_NAME)))
        self.loop = Loop(
            self.bench, readings, self.recorder, clients, MonotonicClock(), campaign.unattended, self._publish
        )

    def run(self) -> None:
        """The whole campaign; never raises what belongs to bench or operator. Motor at zero and all closed, whatever is raised."""
        try:
            try:
                self._stages()
                self.status.outcome = "completed"
            except Stopped as stop:
                self._conclude(stop.outcome, str(stop))
            except RigError as error:
                self._conclude("aborted", str(error))
            self._rest()
            self._farewell()
        finally:
            if self.status.outcome in ("", "running"):
                self.status.outcome, self.status.cause = "aborted", "the controller failed; its log says where"
            self._rest()
            self._close()

    def _stages(self) -> None:
        self._connect()
        self._preflight()
        for index in range(len(self.status.thrusters)):
            self.status.run = index
            self._mount()
            self._record()

    # stages

    def _connect(self) -> None:
        """Open the devices one by one, and say how it went; a device that fails ends the campaign here."""
        failures: dict[str, str] = {}
        names = tuple(self.bench.instruments)
        for name in names:
            self._show_devices(failures, names)
            self._turn()
            try:
                self._say("info", f"{name}: {self.bench.open_device(name)}")
            except (LinkError, DeviceError) as error:
                failures[name] = str(error)
                self._say("error", str(error))
            if name == self.campaign.bench.motor and name not in failures:
                self.motor = self.bench.motor
        self._show_devices(failures, names)
        if failures:
            self._turn()
            raise DeviceError(next(iter(failures.values())))
        self._say("info", real_time())

    def _preflight(self) -> None:
        """Judge the bench until the operator starts it; the checks go on while he looks."""
        devices = list(self.status.checks)
        self._turn_for(SETTLE_ROWS * max(stream.period_s for _, stream in self.bench.streams()))
        started = False
        while not started:
            requests = self._turn()
            self.status.state = "preflight"
            checks = all_checks(self.campaign.bench, self.loop.readings, self.bench.motor.watchdog, self.loop.now)
            self.status.checks = devices + checks
            failed = [check for check in checks if check.verdict == "failed"]
            if any(request.kind == "start" for request in requests):
                started = not failed
                if failed:
                    self._say("warning", f"not started: {failed[0].name}: {failed[0].text}")
        self.status.started = self.loop.now
        self.status.outcome = "running"
        self.ledger.write("start", campaign=self.campaign.name, thrusters=self.status.thrusters)
        self.loop.watch()

    def _mount(self) -> None:
        """Put the thruster on the bench: by the bench's own command, or by the operator, who says when it is there."""
        self.status.state = "mount"
        self.status.points.clear()
        self.status.output = None
        thruster, mount = self.status.thruster, self.campaign.bench.mount
        if not mount.command:
            self._say("info", f"put {thruster} on the bench")
            while not any(request.kind == "mounted" for request in self._turn()):
                pass
            return
        fill = {"thruster": thruster, "bench_dir": str(self.campaign.bench.path.parent), "python": sys.executable}
        words = [word.format(**fill) for word in mount.command]
        with subprocess.Popen(
            words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        ) as child:
            try:
                self._await(
                    lambda: child.poll() is not None, mount.timeout, f"the mount command {words} for {thruster}"
                )
            except RigError:
                child.kill()
                raise
            said = (child.stdout.read() if child.stdout else b"").decode(errors="replace").strip()
        if child.returncode != 0:
            raise DeviceError(
                f"{thruster} could not be mounted: {words[0]} ended with status {child.returncode}: {said}"
            )
        self._say("info", f"{thruster} mounted{': ' + said if said else ''}")

    def _record(self) -> None:
        """One run of one thruster into one file."""
        path = recording_path(self.folder, self.status.thruster)
        t0_ns = self.loop.clock.now_ns()
        self.recorder.open(opening(self.campaign, self.bench, self.status.thruster, path, t0_ns), self.loop.now)
        self.loop.clients.clear_trace()
        self.loop.begin_recording(t0_ns)
        self.status.files.append(str(path))
        self._await_recorder(lambda: self.recorder.ready, f"open {path}")
        settings = settings_for(self.campaign, self.status.thruster)
        if self.status.run > 0:
            settings = replace(settings, proof=None)  # the motor controller is the one that was proved in the first run
        sequencer = Sequencer(self.campaign.plan, settings)
        self.ledger.write("run_start", thruster=self.status.thruster, recording=str(path), recording_t0_ns=t0_ns)
        output = self._sequence(sequencer, t0_ns)
        self._close_recording(output)

    def _sequence(self, sequencer: Sequencer, t0_ns: int) -> Output:
        """Ticks until the sequencer is done, also through a stop until the propeller's rest is known."""
        begun = self.loop.now

        def decide(inputs: Inputs) -> Decision:
            since_begun = inputs.now - begun
            thrust = self.loop.thrust_rows(inputs.samples, round(begun * 1e9))
            trip = replace(inputs.trip, time=since_begun) if inputs.trip else None
            output = sequencer.advance(Tick(since_begun, thrust, inputs.rotation, trip, inputs.requests))
            self._take(output, offset=begun - t0_ns * 1e-9)
            self._note(inputs.requests)
            return Decision(output.volts, output.release)

        while self.status.output is None or not self.status.output.done:
            self.loop.tick(self.motor, decide)
        return self.status.output

    def _take(self, output: Output, offset: float) -> None:
        """Show and record what the sequencer finished in this tick; its times start `offset` s into the recording."""
        self.status.output, self.status.state = output, output.state
        if output.outcome != "running":
            self.status.outcome, self.status.cause = output.outcome, output.cause
            self.status.stop_confirmed = output.stop_confirmed
        self.status.points.extend(output.points)
        for row in output.rows:
            start, end = row.t_start + offset, row.t_end + offset
            self.recorder.step(StepRow(row.index, row.phase, row.command_voltage, start, end))
            self.ledger.write("step", thruster=self.status.thruster, index=row.index, phase=row.phase, t_end=end)
        for line in output.events:
            self._log(replace(line, time=line.time + offset))

    def _close_recording(self, output: Output) -> None:
        """Close the file in order and tell the ledger; a run that did not complete ends the campaign."""
        for name, instrument in self.bench.instruments.items():
            health = instrument.health()
            if health.bad:
                first = "; ".join(health.first_bad)
                self._say(
                    "warning",
                    f"{name}: {health.bad} of {health.received} frames could not be understood, first: {first}",
                )
        outcome = "aborted" if output.outcome == "running" else output.outcome
        self.recorder.close_file(outcome, output.cause)
        self.loop.end_recording()
        self.loop.guarded = False
        self._await_recorder(lambda: self.recorder.closed is not None or bool(self.recorder.failed), "close the file")
        digest = self.recorder.closed.sha256 if self.recorder.closed else ""
        self.ledger.write(
            "run_end", thruster=self.status.thruster, outcome=outcome, cause=output.cause, sha256=digest,
            recording=self.status.files[-1], time_to_zero_s=output.time_to_zero_s,
        )  # fmt: skip
        if outcome != "completed":
            raise Stopped(outcome, output.cause)
        if self.recorder.failed:
            raise LinkError(f"recorder: {self.recorder.failed}")
        self.loop.watch()

    # ticks outside a run

    def _turn(self) -> tuple[Request, ...]:
        """One tick at zero volts; a stop request or a trip ends the campaign."""
        seen: list[Inputs] = []

        def idle(inputs: Inputs) -> Decision:
            seen.append(inputs)
            return IDLE

        self.loop.tick(self.motor, idle)
        inputs = seen[0]
        self._note(inputs.requests)
        stop = next((request for request in inputs.requests if request.kind == "stop"), None)
        if stop is not None:
            raise Stopped("aborted", f"stopped by {stop.text or 'the operator'}")
        if inputs.trip is not None:
            raise Stopped("tripped", inputs.trip.cause)
        return inputs.requests

    def _turn_for(self, seconds: float) -> None:
        end = self.loop.now + seconds
        while self.loop.now < end:
            self._turn()

    def _await(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Tick at zero volts until `done`; LinkError that names what was waited for when it takes longer than `timeout` s."""
        end = self.loop.now + timeout
        while not done():
            self._turn()
            if self.loop.now > end:
                raise LinkError(f"waited {timeout:g} s for {what}; it did not happen")

    def _await_recorder(self, done: Callable[[], bool], what: str) -> None:
        """The same for the recorder; a request that comes meanwhile is kept for the next stage, a stop among them."""
        end = self.loop.now + RECORDER_WAIT
        held: list[Request] = []

        def hold(inputs: Inputs) -> Decision:
            held.extend(inputs.requests)
            return IDLE

        while not done():
            self.loop.tick(self.motor, hold)
            if self.recorder.failed and not done():
                raise LinkError(f"recorder: {self.recorder.failed}")
            if self.loop.now > end:
                raise LinkError(f"waited {RECORDER_WAIT:g} s for the recorder to {what}; it did not happen")
        self.loop.signals.extend(held)

    def _rest(self) -> None:
        """Zero, whatever came before: by command, and by the second way when the first is refused or not enough."""
        self.loop.guarded = False
        if self.motor is None:
            return
        try:
            self.motor.command(0.0)
        except WireError as error:
            self._say("error", f"command 0 was refused: {error}")
        try:
            self.motor.release()
        except WireError as error:
            self._say("error", f"release was refused: {error}")

    def _farewell(self) -> None:
        """Show the end to front ends that are there."""
        self.status.state = "done"
        end = self.loop.now + FAREWELL
        while self.loop.now < end and self.loop.clients.connected:
            self.loop.tick(self.motor, lambda _: IDLE)

    def _close(self) -> None:
        self.recorder.shut_down()
        self.loop.clients.close()
        remove(socket_path(self.folder, SOCKET_NAME))
        self.bench.close()
        self.ledger.write("end", outcome=self.status.outcome, cause=self.status.cause)
        self.ledger.close()

    # what is said

    def _conclude(self, outcome: Literal["aborted", "tripped"], cause: str) -> None:
        """How the campaign ended; a run that said so itself has told more."""
        if self.status.outcome in ("", "running", "completed"):
            self.status.outcome, self.status.cause = outcome, cause
            self._say("trip" if outcome == "tripped" else "warning", cause)

    def _show_devices(self, failures: dict[str, str], names: Iterable[str]) -> None:
        self.status.checks = device_checks(self.bench.identities, failures, names)

    def _note(self, requests: Iterable[Request]) -> None:
        for request in requests:
            if request.kind == "note":
                self._say("info", f"note: {request.text}")
            elif request.kind == "detach":
                self._say("info", "a front end detached")

    def _say(self, level: Level, text: str) -> None:
        since = self.loop.recording_since_ns
        self._log(LogLine(0.0 if since is None else self.loop.now - since * 1e-9, level, text))

    def _log(self, line: LogLine) -> None:
        self.status.say(line)
        print(f"{line.time:10.3f} {line.level:<7} {line.text}", flush=True)
        if self.loop.recording_since_ns is not None:
            self.recorder.event(EventRow(line.time, line.level, line.text))

    def _publish(self, now: float) -> None:
        since = self.loop.recording_since_ns
        time = 0.0 if since is None else now - since * 1e-9
        readings = self.loop.readings.view(now)
        self.loop.clients.publish(self.status.snapshot(now, time, self.loop.command, readings))


def real_time() -> str:
    """Ask for real-time scheduling of this thread; says what came of it (performance.md, loop lateness)."""
    gc.freeze()
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(10))
    except PermissionError:
        return "no real-time scheduling: not permitted to this user; the loop shares the processor with everything else"
    return "real-time scheduling (SCHED_FIFO) for the control loop"
