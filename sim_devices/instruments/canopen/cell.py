"""Device side of a CANopen load cell by the profile CiA 404, one input: process value as float and integers, status.

Source: the manuals of FMS EMGZ480 and esd CAN-CBX for the status word, of Axiomatic AX030301 for the objects; CiA 301
for the rest (node.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isnan

from sim_devices.instruments.canopen.node import Node
from sim_devices.instruments.canopen.objects import OUT_OF_RANGE, Object
from sim_devices.instruments.lies import LIES, Lying
from sim_devices.instruments.serial_lines.mt_sics_options import UNITS
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

CODES = {"N": 0x00210000, "kg": 0x00020000, "g": 0x004B0000}
"""0x6131 (CiA 303-2)."""
NOT_VALID, OVER, UNDER = 0x01, 0x03, 0x05
"""0x6150."""
ZERO = int.from_bytes(b"zero", "little")


@dataclass(frozen=True, slots=True)
class Cia404Options:
    """`[devices.<name>]` of kind cia404."""

    kind: str
    node_id: int = 6
    unit: str = "N"
    decimals: int = 2
    """Of the integer values (0x6132)."""
    capacity: float = 500.0
    """N"""
    lacks: tuple[str, ...] = ()
    """Indices of objects that it does not have, hexadecimal."""
    model: str = "SIM404"

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= 127 or self.unit not in CODES or not 0 <= self.decimals <= 6:
            raise ValueError(f"node_id 1 to 127, unit one of {', '.join(CODES)} and 0 to 6 decimals are needed")


class Cell404:
    """One cell. `read` gives the force on it in N (NaN: the converter has no number)."""

    faults = ("frozen", "silent", "overload", "underload", "converter", "no_heartbeat", "reboot", *LIES)

    def __init__(self, options: Cia404Options, read: Callable[[], float]) -> None:
        self._options = options
        self._lying = Lying(read, 10.0**-options.decimals * UNITS[options.unit])
        self._fault = ""
        self._zero = self._value = 0.0
        name = f"{options.model} load cell"
        self.node = Node(options.node_id, 0x00020194, name, self._refresh, self._written, self._lost, self._start)
        self._fill()
        self.node.deliver()

    def _fill(self) -> None:
        o, objects = self._options, self.node.objects
        shown = {0x6110: ("H", 90), 0x6130: ("f", 0.0), 0x7130: ("h", 0), 0x9130: ("i", 0), 0x6150: ("B", 0)}
        shown |= {0x6131: ("I", CODES[o.unit]), 0x6132: ("B", o.decimals)}
        for index, (form, value) in shown.items():
            objects[index, 0], objects[index, 1] = Object("B", 1), Object(form, value)
        objects[0x6125, 0] = Object("B", 1)
        objects[0x6125, 1] = Object("I", 0, True, lambda value: 0 if value == ZERO else OUT_OF_RANGE)
        for mapped in ((0x61300120,), (), (), ()):
            self.node.add_sent(mapped)
        for place in [place for place in objects if f"{place[0]:04x}" in [each.lower() for each in o.lacks]]:
            del objects[place]

    def _start(self) -> None:
        """As after power-up."""
        self._zero = 0.0

    def _lost(self, _t: float) -> None:
        """It measures on, whoever listens."""

    def _written(self, index: int, _sub: int, _t: float) -> None:
        if index == 0x6125:
            self._zero = self._lying()

    def _refresh(self) -> None:
        o, objects = self._options, self.node.objects
        if self._fault != "frozen":
            self._value = self._lying() - self._zero
        lost = isnan(self._value) or self._fault == "converter"
        over = self._fault == "overload" or self._value > o.capacity
        under = self._fault == "underload" or self._value < -o.capacity
        shown = 0.0 if lost else self._value / UNITS[o.unit]
        whole = round(shown * 10**o.decimals)
        told: dict[int, float | int] = {0x6130: shown, 0x9130: whole, 0x7130: min(max(whole, -32768), 32767)}
        told[0x6150] = NOT_VALID if lost else OVER if over else UNDER if under else 0
        for index, value in told.items():
            if (index, 1) in objects:
                objects[index, 1].value = value

    # -- the bus -----------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        return self.node.due

    def tick(self, t: float) -> list[CanFrame]:
        return self.node.tick(t)

    def receive(self, frame: CanFrame, t: float) -> list[CanFrame]:
        return self.node.receive(frame, t)

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"load cell: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self.node.boot(t)
            return
        self._fault = name
        self._lying.begin(name if name in LIES else "", amount)
        self.node.deaf, self.node.beats = name == "silent", name != "no_heartbeat"

    def clear(self, _t: float) -> None:
        self._fault, self.node.deaf, self.node.beats = "", False, True
        self._lying.begin("", DEFAULT_AMOUNT)
