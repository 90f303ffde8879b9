"""A bench in virtual time: the world, its devices on their wires and the computer's lateness; sleeping moves it on.

What the desk-top bench is in the machine's time. The host is whoever sleeps on this clock and talks over these wires.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from math import inf

import numpy as np

from sim_devices.bench.devices import can_node, say, serial_device, turnaround
from sim_devices.bench.motors import motor
from sim_devices.bench.settings import MOTORS, NODES, BenchSettings, MotorOptions, script
from sim_devices.bench.virtual_wire import Host, VirtualWire
from sim_devices.instruments.can_node import CanNode
from sim_devices.instruments.drive import Drive
from sim_devices.instruments.low_pass import LowPass
from sim_devices.instruments.serial_device import SerialDevice
from sim_devices.tables import WorldError
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT, WIRE_FAULTS, Wire
from sim_devices.wires.slcan import Adapter
from sim_devices.world import World

BEGIN_NS = 10**12
"""Of the host's clock when the bench begins."""
EPOCH = datetime(2026, 1, 1, tzinfo=UTC)
FILTERED = 0.0005
"""s, the longest step of a world whose force goes through a low pass: to it the force stands still in a step."""
SAME = 1e-9
"""s: two times that are no closer than this are two."""


class VirtualBench:
    """`now_ns` and `sleep_until_ns` are the host's clock, `wires` the near ends by the names of devices and buses."""

    def __init__(
        self, settings: BenchSettings, host: Host, bus: str, filters: Mapping[str, float] | None = None
    ) -> None:
        """`bus`: the host's name for the adapter. `filters`: s, time constant of the low pass in a load cell's
        amplifier, by the device's name."""
        world_rng, wire_rng, cross_rng, self._host_rng = np.random.default_rng(settings.seed).spawn(4)
        self.settings, self.host = settings, host
        self.world = World(settings.world, world_rng)
        self.commands: list[tuple[float, float]] = []
        """(s, V) of every voltage that the drive took up."""
        self._t, self._told = 0.0, False
        self._wire_rng = wire_rng
        self._low_passes: list[LowPass] = []
        self._adapter, self._bus = Adapter(), self._wired(bus, None)
        self.serial: dict[str, tuple[SerialDevice, VirtualWire, float]] = {}
        self.nodes: dict[str, CanNode] = {}
        """Devices on the CAN bus."""
        self._after_step: Callable[[float], None] | None = None
        self._require_one_motor()
        for name, options in settings.devices.items():
            if isinstance(options, MOTORS):
                self._add_motor(name, options)
                continue
            if isinstance(options, NODES):
                self.nodes[name] = can_node(options, self.world, self._cell((filters or {}).get(name, 0.0)))
                continue
            device = serial_device(options, self.world, cross_rng, EPOCH, self._cell((filters or {}).get(name, 0.0)))
            self.serial[name] = (device, self._wired(name, options.baud), turnaround(options))
        self._ends = [self._bus, *(wire for _, wire, _ in self.serial.values())]
        self.wires: Mapping[str, VirtualWire] = {wire.name: wire for wire in self._ends}
        self._next_stall = self._until_stall()
        self._script = script(settings.faults)

    def _require_one_motor(self) -> None:
        motors = [options for options in self.settings.devices.values() if isinstance(options, MOTORS)]
        if len(motors) != 1:
            raise WorldError(f"devices: a bench in virtual time has one motor controller, this one {len(motors)}")

    def _add_motor(self, name: str, options: MotorOptions) -> None:
        made = motor(options, self.world, self._log)
        self.drive: Drive = made.drive
        """What turns the thruster."""
        self._after_step = made.after_step
        if made.node is not None:
            self.nodes[name] = made.node
        if made.serial is not None:
            device, _, baud = made.serial
            self.serial[name] = (device, self._wired(name, baud), 0.0)

    def fault(self, device: str, name: str, amount: float = DEFAULT_AMOUNT) -> None:
        """A device or its wire goes wrong from now on. Raises ValueError for a fault that neither has."""
        found, wire = self._device(device)
        if wire is not None and name in WIRE_FAULTS:
            wire.wire.fault(name, amount)
        else:
            found.fault(name, self._t, amount)

    def clear(self, device: str) -> None:
        """Device and wire are in order again."""
        found, wire = self._device(device)
        found.clear(self._t)
        if wire is not None:
            wire.wire.clear()

    def _device(self, name: str) -> tuple[SerialDevice | CanNode, VirtualWire | None]:
        return self.serial[name][:2] if name in self.serial else (self.nodes[name], None)

    def _cell(self, time_constant: float) -> Callable[[], float] | None:
        """What a converter behind a low pass reads; None without one."""
        if not time_constant:
            return None
        low_pass = LowPass(time_constant)
        low_pass.follow(self.world.exact("thrust"), 0.0)
        self._low_passes.append(low_pass)
        return lambda: self.world.converted("thrust", low_pass.value)

    def _wired(self, name: str, baud: int | None) -> VirtualWire:
        return VirtualWire(name, self, Wire(baud, self._wire_rng), self.host, self._host_rng)

    # -- the host's clock --------------------------------------------------------------------------------------------

    def now(self) -> float:
        """S since the bench began."""
        return self._t

    def stamp(self, t: float) -> int:
        return BEGIN_NS + round(t * 1e9)

    def now_ns(self) -> int:
        return self.stamp(self._t)

    def sleep_until_ns(self, t_ns: int) -> None:
        """The control loop wakes late, as on any machine."""
        late = self.host.loop_late * float(self._host_rng.standard_exponential())
        self._run_to(max((t_ns - BEGIN_NS) * 1e-9 + late, self._busy_until(t_ns)))

    def wait(self, seconds: float) -> None:
        """Until something was told to the host, or `seconds` are over."""
        end, self._told = self._t + seconds, False
        while self._t < end and not self._told:
            self._run_to(min(self._next_event(), end))

    def _busy_until(self, t_ns: int) -> float:
        """A stall that is on at that time ends then, and no reader runs before."""
        t = (t_ns - BEGIN_NS) * 1e-9
        end = -inf
        while self._next_stall <= t:
            end = self._next_stall + self.host.stall * float(self._host_rng.random())
            for wire in self._ends:
                wire.stall(end)
            self._next_stall = max(end, self._next_stall) + self._until_stall()
        return end

    def _until_stall(self) -> float:
        every = self.host.stall_every
        return every * float(self._host_rng.standard_exponential()) if every < inf else inf

    # -- what happens ------------------------------------------------------------------------------------------------

    def _next_event(self) -> float:
        devices = [device.due for device, _, _ in self.serial.values()]
        nodes = (node.due for node in self.nodes.values())
        return min([*devices, *nodes, *(wire.due for wire in self._ends)])

    def _run_to(self, t: float) -> None:
        """Event by event, each in the world of its own instant."""
        while self._script and self._script[0][0] <= t:
            at, begins, entry = self._script.pop(0)
            self._move_world(max(at, self._t))
            if begins:
                self.fault(entry.device, entry.fault, entry.amount)
            else:
                self.clear(entry.device)
        while (due := self._next_event()) <= t:
            self._move_world(max(due, self._t))
            self._happen(self._t)
        self._move_world(t)

    def _move_world(self, t: float) -> None:
        world, drive, after = self.world, self.drive, self._after_step
        step = min(self.settings.step, FILTERED) if self._low_passes else self.settings.step
        state = world.state
        while (left := t - state.t) > SAME:
            dt = min(step, left)
            volts, amps = drive.drive(state.n, dt)
            world.step(dt, volts, amps)
            if after:
                after(dt)
            for low_pass in self._low_passes:
                low_pass.follow(world.exact("thrust"), dt)
        self._t = max(t, self._t)

    def _happen(self, t: float) -> None:
        for node in self.nodes.values():
            if node.due <= t:
                for frame in node.tick(t):
                    self._broadcast(frame, t, node)
        for device, wire, late in self.serial.values():
            if device.due <= t:
                say(wire.wire, device.tick(t), t, late)
            if data := wire.heard(t):
                say(wire.wire, device.feed(data, t), t, late)
        if data := self._bus.heard(t):
            answer, frames = self._adapter.feed(data)
            if answer:
                self._bus.wire.put(answer, t)
            for frame in frames:
                self._broadcast(frame, t, None)
        for wire in self._ends:
            if wire.due <= t:
                self._told = wire.carry(t) or self._told

    def _broadcast(self, frame: CanFrame, t: float, sender: CanNode | None) -> None:
        """A frame on the bus: every other node hears it; sender None: the host."""
        if sender is not None and (line := self._adapter.deliver(frame)):
            self._bus.wire.put(line, t)
        for node in self.nodes.values():
            if node is not sender:
                for answer in node.receive(frame, t):
                    self._broadcast(answer, t, node)

    def _log(self, event: str, **fields: object) -> None:
        """Only what the motor was really driven with is of use here."""
        if event in ("command", "timeout"):
            volts = fields["volts"]
            self.commands.append((self._t, float(volts) if isinstance(volts, float | int) else 0.0))
