"""A desk-top bench: the world, the devices on their ports, the truth log, kept in step with the wall clock."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from math import inf
from pathlib import Path

import numpy as np

from sim_devices.bench.control import clear, fault, obey
from sim_devices.bench.devices import can_node, say, serial_device, turnaround
from sim_devices.bench.motors import motor
from sim_devices.bench.punctual import give_way, on_time
from sim_devices.bench.settings import MOTORS, NODES, BenchSettings, DeviceOptions, load, script
from sim_devices.bench.truth_log import TruthLog, header_fields, state_fields
from sim_devices.instruments.can_node import CanNode
from sim_devices.instruments.drive import Drive
from sim_devices.instruments.serial_device import SerialDevice
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.ports import ControlSocket, PtyPort, wait
from sim_devices.wires.serial_line import Wire
from sim_devices.wires.slcan import Adapter
from sim_devices.world import World

LONGEST_SLEEP = 0.01
"""s between two looks at the clock and the stop request."""
STALL = 0.1
"""s: after a gap like this the simulator itself stood still; what the host sent meanwhile is heard first."""
STATE_PERIOD = 0.01
"""s between two `state` lines of the truth log while the rotor turns; ten times that at rest."""
AT_REST = 0.01
"""rev/s: a rotor slower than this is logged less often."""


def start(world_toml: Path, links: Path | None = None, truth: Path | None = None, seed: int | None = None) -> Bench:
    """Open a bench: ports are there when this returns. Raises WorldError for a world file that cannot be run."""
    settings = load(world_toml)
    settings = replace(
        settings,
        links=links.absolute() if links else settings.links,
        truth=truth.absolute() if truth else settings.truth,
        seed=settings.seed if seed is None else seed,
    )
    return Bench(settings)


class Bench:
    """Open from construction to `close`. `run` is the whole life of it; one thread."""

    def __init__(self, settings: BenchSettings) -> None:
        self.settings = settings
        world_rng, wire_rng, self._cross_rng = np.random.default_rng(settings.seed).spawn(3)
        self._wire_rng = wire_rng
        self.world = World(settings.world, world_rng)
        self.control = ControlSocket(settings.links / "control")  # first: it refuses a second bench on these links
        self._start_ns = time.monotonic_ns()
        self._epoch = datetime.now(UTC)
        self._steps = 0
        self._heard_at = 0.0
        self._next_state = 0.0
        self.truth = TruthLog(settings.truth)
        self.nodes: dict[str, CanNode] = {}
        """Devices on the CAN bus."""
        self.drive: Drive | None = None
        """What turns the thruster."""
        self._after_step: Callable[[float], None] | None = None
        self._command_gain = 1.0
        self.serial: dict[str, tuple[SerialDevice, PtyPort, float]] = {}
        """device name -> device, its port, its turnaround (s)."""
        self.adapters = {name: (Adapter(), self._port(name, None)) for name in settings.can.adapters}
        for name, options in settings.devices.items():
            self._add(name, options)
        self._script = script(settings.faults)
        self.log("header", seed=settings.seed, command_gain=self._command_gain, **header_fields(settings.world))

    def _port(self, name: str, baud: int | None) -> PtyPort:
        return PtyPort(self.settings.links / name, Wire(baud, self._wire_rng))

    def _add(self, name: str, options: DeviceOptions) -> None:
        if isinstance(options, MOTORS):
            made = motor(options, self.world, self.log)
            self.drive, self._after_step, self._command_gain = made.drive, made.after_step, made.gain
            if made.node is not None:
                self.nodes[name] = made.node
            if made.serial is not None:
                device, port, baud = made.serial
                self.serial[name] = (device, self._port(port, baud), 0.0)
            return
        if isinstance(options, NODES):
            self.nodes[name] = can_node(options, self.world)
            return
        device = serial_device(options, self.world, self._cross_rng, self._epoch)
        self.serial[name] = (device, self._port(options.port, options.baud), turnaround(options))

    # -- time --------------------------------------------------------------------------------------------------------

    def now(self) -> float:
        """S since the bench was started."""
        return (time.monotonic_ns() - self._start_ns) * 1e-9

    def run(self, stop: Callable[[], bool]) -> None:
        """Live until `stop()` is true, ahead of what else the machine does where that is permitted."""
        self.turn(self.now())
        on_time()
        while not stop():
            self.turn(self.now())
            wait(self.ports, self.control, min(max(self._due() - self.now(), 0.0), LONGEST_SLEEP))

    def turn(self, t: float) -> None:
        """Bring everything up to t (s)."""
        if t - self._heard_at > STALL:
            give_way()
            self._listen(t)
        self._run_script(t)
        self._advance(t)
        self._listen(t)
        self._heard_at = t
        for port in self.ports:
            if port.due <= t:
                port.flush(t)

    @property
    def ports(self) -> list[PtyPort]:
        return [port for _, port in self.adapters.values()] + [port for _, port, _ in self.serial.values()]

    def _due(self) -> float:
        return min([self._device_due(), *(port.due for port in self.ports)])

    def _device_due(self) -> float:
        serial = (device.due for device, _, _ in self.serial.values())
        return min([*serial, *(node.due for node in self.nodes.values())], default=inf)

    def _advance(self, t: float) -> None:
        """World and devices to t, device by device in the order in which they are due."""
        while True:
            due = self._device_due()
            self._step_world(min(due, t))
            if due > t:
                return
            self._tick(due)

    def _tick(self, t: float) -> None:
        for node in self.nodes.values():
            if node.due <= t:
                for frame in node.tick(t):
                    self._broadcast(frame, t, node)
        for device, port, late in self.serial.values():
            if device.due <= t:
                say(port.wire, device.tick(t), t, late)

    def _step_world(self, t: float) -> None:
        dt, world, drive, after = self.settings.step, self.world, self.drive, self._after_step
        s = world.state
        while (self._steps + 1) * dt <= t:
            self._steps += 1
            volts, amps = drive.drive(s.n, dt) if drive else (None, 0.0)
            world.step(dt, volts, amps)
            if after:
                after(dt)
            if s.t >= self._next_state:
                self._log_state()

    # -- bytes -------------------------------------------------------------------------------------------------------

    def _listen(self, t: float) -> None:
        for adapter, port in self.adapters.values():
            data = port.read()
            if not data:
                continue
            answer, frames = adapter.feed(data)
            if answer:
                port.wire.put(answer, t)
            for frame in frames:
                self._broadcast(frame, t, port)
        for device, port, late in self.serial.values():
            data = port.read()
            if data:
                say(port.wire, device.feed(data, t), t, late)
        self.control.serve(lambda line: obey(self, line))

    def _broadcast(self, frame: CanFrame, t: float, sender: PtyPort | CanNode) -> None:
        """A frame on the bus: every other node hears it."""
        for adapter, port in self.adapters.values():
            if port is not sender and port.plugged:
                line = adapter.deliver(frame)
                if line:
                    port.wire.put(line, t)
        for node in self.nodes.values():
            if node is not sender:
                for answer in node.receive(frame, t):
                    self._broadcast(answer, t, node)

    def _run_script(self, t: float) -> None:
        while self._script and self._script[0][0] <= t:
            _, begins, entry = self._script.pop(0)
            if begins:
                fault(self, entry.device, entry.fault, entry.amount)
            else:
                clear(self, entry.device)

    # -- truth -------------------------------------------------------------------------------------------------------

    def log(self, event: str, **fields: object) -> None:
        """One line of the truth log, stamped now."""
        self.truth.write(event, time.monotonic_ns(), self.world.mounted, **fields)

    def _log_state(self) -> None:
        s = self.world.state
        turning = abs(s.n) > AT_REST or s.command != 0.0
        self._next_state = s.t + (STATE_PERIOD if turning else 10.0 * STATE_PERIOD)
        stamp = self._start_ns + round(s.t * 1e9)
        self.truth.write("state", stamp, self.world.mounted, **state_fields(s))

    def listing(self) -> list[str]:
        """One line per port: name, path the rig opens, device behind it."""
        lines = [f"{port.link.name} {port.link} {port.device}" for port in self.ports if port.plugged]
        return [*lines, f"control {self.control.link} {self.control.path}"]

    def close(self) -> None:
        """Ports and links are gone afterwards."""
        for port in self.ports:
            port.pull()
        self.control.close()
        self.truth.close()
