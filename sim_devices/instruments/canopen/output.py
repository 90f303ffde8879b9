"""Device side of an analogue output of CiA 401 on CANopen, and of the amplifier that its control voltage goes to.

Source: CiA 401 (0x6411 output, 0x6443 error mode, 0x6444 error value: taken when the module fails or is stopped), CiA
301 for the rest (node.py). When it is started again the output has what it was told last: the standard asks for nothing
else, and a host that does not write 0 before finds its motor running.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sim_devices.instruments.canopen.node import STOPPED, Node
from sim_devices.instruments.canopen.objects import OUT_OF_RANGE, Object
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


@dataclass(frozen=True, slots=True)
class Cia401Options:
    """`[devices.<name>]` of kind cia401."""

    kind: str
    node_id: int = 7
    outputs: int = 4
    """The amplifier is at the first."""
    counts_per_volt: float = 3276.7
    gain: float = 2.4
    """V at the motor for 1 V of control voltage."""
    error_value_bits: int = 32
    """Of 0x6444: 16 or 32, by maker."""
    keeps_error_mode: bool = False
    """Takes an error mode (0x6443) and keeps 0: the last voltage stays for ever."""
    broken_watchdog: bool = False
    """The heartbeat that it waits for is configured and never missed."""
    lacks: tuple[str, ...] = ()
    """Indices of objects that it does not have, hexadecimal."""
    model: str = "SIM401"

    def __post_init__(self) -> None:
        if not (1 <= self.node_id <= 127 and 1 <= self.outputs <= 4 and self.error_value_bits in (16, 32)):
            raise ValueError("node_id 1 to 127, 1 to 4 outputs and error_value_bits 16 or 32 are needed")
        if self.counts_per_volt == 0.0 or self.gain == 0.0:
            raise ValueError("counts_per_volt and gain must not be 0")


class Output401:
    """One module with its amplifier. `log` writes what happened to the truth."""

    faults = ("silent", "broken_watchdog", "no_heartbeat", "reboot", "ignores_commands", "backwards", "redrives")

    def __init__(self, options: Cia401Options, supply: float, log: Log) -> None:
        """`supply`: V, of the amplifier."""
        self._options, self._supply, self._log = options, supply, log
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._told = 0
        name = f"{options.model} analogue output"
        self.node = Node(options.node_id, 0x00080191, name, self._refresh, self._written, self._lost, self._start)
        self._fill()
        self.node.waits = not options.broken_watchdog
        self.node.deliver()

    def _fill(self) -> None:
        o, objects = self._options, self.node.objects
        for index in (0x6411, 0x6443, 0x6444):
            objects[index, 0] = Object("B", o.outputs)
        for channel in range(1, o.outputs + 1):
            objects[0x6411, channel] = Object("h", 0, writable=True)
            objects[0x6443, channel] = Object("B", 0, True, lambda value: 0 if value in (0, 1) else OUT_OF_RANGE)
            objects[0x6444, channel] = Object("i" if o.error_value_bits == 32 else "h", 0, writable=True)
        self.node.add_received()
        self.node.add_received(tuple(0x64110010 | channel << 8 for channel in range(1, o.outputs + 1)))
        for place in [place for place in objects if f"{place[0]:04x}" in [each.lower() for each in o.lacks]]:
            del objects[place]

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def output(self) -> float:
        """V at the output now."""
        return self._counts() / self._options.counts_per_volt

    def _counts(self) -> int:
        number = self.node.objects.number
        if self.node.state == STOPPED and number(0x6443, 1):
            return number(0x6444, 1)
        return number(0x6411, 1)

    def drive(self, _n: float, _dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step."""
        if self._fault == "redrives":
            return self._amount * self._supply, 0.0
        wanted = self.output * self._options.gain * (-1.0 if self._fault == "backwards" else 1.0)
        return min(max(wanted, -self._supply), self._supply), 0.0

    def _say_command(self) -> None:
        """To the truth log, when the output has changed."""
        if (counts := self._counts()) != self._told:
            self._told = counts
            self._log("command", mode="output", value=counts, volts=self.output)

    # -- the bus -----------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        return self.node.due

    def tick(self, t: float) -> list[CanFrame]:
        said = self.node.tick(t)
        self._say_command()
        return said

    def receive(self, frame: CanFrame, t: float) -> list[CanFrame]:
        if self._fault == "ignores_commands" and frame.id == 0x300 + self.node.id:
            return []
        said = self.node.receive(frame, t)
        self._say_command()
        return said

    def _refresh(self) -> None:
        """Nothing is measured."""

    def _start(self) -> None:
        """As after power-up: `deliver` has set the output to 0."""

    def _written(self, index: int, sub: int, _t: float) -> None:
        if index == 0x6443 and self._options.keeps_error_mode:
            self.node.objects[index, sub].value = 0

    def _lost(self, t: float) -> None:
        self._log("timeout", volts=self.output, after=t - self.node.heard)
        self._told = self._counts()

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self.node.boot(t)
            return
        self._fault, self._amount = name, amount
        self.node.deaf, self.node.beats = name == "silent", name != "no_heartbeat"
        self.node.waits = name != "broken_watchdog" and not self._options.broken_watchdog

    def clear(self, _t: float) -> None:
        self._fault, self.node.deaf, self.node.beats = "", False, True
        self.node.waits = not self._options.broken_watchdog
