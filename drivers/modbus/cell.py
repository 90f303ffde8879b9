"""Force from a load-cell transmitter on Modbus RTU, whatever the model: a map file says which register holds what.

The device is polled: one request a sample, with weight and status in the same reply, so that they belong together.
The maps that come with the rig are in `drivers/modbus/maps`, each with its manual and page.
"""

from __future__ import annotations

import contextlib
import json
import math

from drivers.errors import DeviceError
from drivers.force_units import NEWTONS_PER_UNIT
from drivers.modbus.cell_options import Options, chosen
from drivers.modbus.maps import Code, WordOrder, span
from drivers.modbus.maps.numbers import other, sane, status, weight
from drivers.modbus.poll import ModbusPoll
from drivers.modbus.rtu import Read, Registers, Unreadable
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import line_time
from drivers.ports.serial_port import SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream

LOOKS = 5
"""Readings at opening that tell the order of the words: in the wrong one a float that moves at all leaps by decades."""
BEYOND = 2.0
"""Times its range that a cell may read, and still be a cell."""
LARGEST = 1e6
"""N; no cell of a thruster's stand bears more, where the bench file gives no range."""


class ModbusCell:
    """A force sensor: stream `<name>` with `thrust` [N]; `stable`, `status` and `raw` where the device has them."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._map, self._reading = chosen(options)
        self._request = Read(options.address, self._map.function, *span(self._map, self._reading))
        self._order: WordOrder = options.word_order or self._map.word_order
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._poll = ModbusPoll(name, settings, options.timeout, wire)
        self._bad = BadRecords()
        self._fault: str | None = None
        self._unit = options.unit
        self._decimals = options.decimals or 0
        self._division: float | None = None

    @property
    def streams(self) -> tuple[Stream, ...]:
        options = self._options
        thrust = Channel(
            "thrust", "thrust", "N", noise_std=options.noise_std, quantum=self._quantum(),
            delay=options.delay + line_time(options.baud, options.framing, self._request.reply_characters),
            delay_std=options.delay_std, window=options.window, low_pass=options.low_pass, filter=options.filter,
            range_min=options.range_min, range_max=options.range_max, calibration=json.dumps(self._calibration()),
        )  # fmt: skip
        channels = [thrust]
        if self._map.status is not None:
            if self._map.status.stable is not None:
                channels.append(Channel("stable", None, "1", description="1: the transmitter calls the reading stable"))
            channels.append(Channel("status", None, "1", integer=True, description="status register as sent"))
        if self._reading.type != "float32":
            channels.append(Channel("raw", None, "1", integer=True, description="number on the wire, with its sign"))
        return (Stream(self.name, "modbus_cell", tuple(channels), 1.0 / options.rate),)

    def open(self) -> str:
        """Reads unit and division where the map has them, tries the order of the words, begins to poll.

        Raises LinkError, or DeviceError when nobody answers or what answers is set otherwise than the bench file says.
        """
        self._bad, self._fault = BadRecords(), None
        self._poll.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._read_unit()
            self._read_division()
            self._look()
            self._poll.start([self._request], self._options.rate)
            undo.pop_all()
        return f"{self._map.title}, Modbus address {self._options.address}, in {self._unit} (serial number not read)"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, record in self._poll.take():
            if isinstance(record, Registers):
                samples.append(Sample(self.name, t_ns, self._values(record.words)))
            else:
                self._bad.add(record.text if isinstance(record, Unreadable) else str(record))
        return samples

    def health(self) -> LinkHealth:
        poll, bad, error = self._poll, self._bad, self._fault or self._poll.error
        return LinkHealth(poll.alive and error is None, poll.received, bad.count, bad.first, error, poll.dropped)

    def tare(self) -> None:
        """Raises DeviceError: the command's code differs from one firmware to the next, and nothing confirms it."""
        raise DeviceError(f"{self.name}: a {self._map.title} is not tared over the wire: tare by subtraction")

    def close(self) -> None:
        self._poll.close()

    # -- at opening --------------------------------------------------------------------------------------------------

    def _read_unit(self) -> None:
        found, wanted = self._map.unit, self._options.unit
        if found is None:
            return
        code, unit = self._said(found)
        if not unit:
            raise DeviceError(
                f"{self.name} is set to a unit that is no force and no mass (code {code} in register {found.register}):"
                " set it to N or kg"
            )
        if wanted is not None and unit != wanted:
            raise DeviceError(f"{self.name} shows {unit}, the bench file says {wanted}: change one of them")
        self._unit = unit

    def _read_division(self) -> None:
        found, wanted = self._map.division, self._options.decimals
        if found is None or self._reading.type == "float32":
            return
        code, step = self._said(found)
        if step is None:
            raise DeviceError(
                f"{self.name} has a division that its map does not know (code {code} in register {found.register}):"
                " add it to the map"
            )
        decimals = len(step.partition(".")[2])
        if wanted is not None and decimals != wanted:
            raise DeviceError(
                f"{self.name} has divisions of {step} ({decimals} decimals), the bench file says {wanted} decimals:"
                " change one of them"
            )
        self._decimals, self._division = decimals, float(step)

    def _said(self, found: Code) -> tuple[int, str | None]:
        request = Read(self._options.address, self._map.function, found.register, 1)
        return found.said(self._poll.ask(request).words[0])

    def _look(self) -> None:
        """Raises DeviceError for a transmitter in trouble, and for weights that are none."""
        seen, exchanged = [], []
        for _ in range(LOOKS):
            words = self._poll.ask(self._request).words
            if trouble := self._trouble(words):
                raise DeviceError(f"{self.name} {trouble}")
            seen.append(self._shown(words, self._order))
            exchanged.append(self._shown(words, other(self._order)))
        if sane(seen, self._largest()):
            return
        first = next(value for value in seen if not sane((value,), self._largest()))
        raise DeviceError(f"{self.name} {self._absurd(first, exchanged)}")

    # -- a sample ----------------------------------------------------------------------------------------------------

    def _values(self, words: tuple[int, ...]) -> tuple[float, ...]:
        """A row: NaN for what is no weight. Where no later weight is worth more, a fault."""
        shown, flags = self._shown(words, self._order), status(words, self._request.register, self._map)
        thrust = self._options.sign * shown * self._newtons()
        if trouble := self._trouble(words):
            thrust = math.nan
            self._fault = self._fault or (f"{self.name} {trouble}" if self._broken(flags) else None)
        elif not sane((shown,), self._largest()):
            thrust = math.nan
            self._bad.add(f"{shown:g} {self._unit}")
            self._fault = self._fault or f"{self.name} {self._absurd(shown, [self._shown(words, other(self._order))])}"
        values, found = [thrust], self._map.status
        if found is not None:
            values += [] if found.stable is None else [float(flags >> found.stable & 1)]
            values.append(float(flags))
        if self._reading.type != "float32":
            values.append(weight(words, self._request.register, self._map, self._reading, self._order))
        return tuple(values)

    def _shown(self, words: tuple[int, ...], order: WordOrder) -> float:
        """As the display has it."""
        counts = weight(words, self._request.register, self._map, self._reading, order)
        return counts if self._reading.type == "float32" else counts / 10.0**self._decimals

    def _trouble(self, words: tuple[int, ...]) -> str:
        """What the status register says against the weight; empty: nothing."""
        flags, found = status(words, self._request.register, self._map), self._map.status
        if found is None:
            return ""
        if self._broken(flags):
            return f"reports a fault of cell or converter (status 0x{flags:04X}): check the cell and its cable"
        if _any(flags, found.overload):
            return f"is overloaded (status 0x{flags:04X}): unload it"
        if _any(flags, found.underload):
            return f"is below its range (status 0x{flags:04X}): check zero and mounting"
        return ""

    def _broken(self, flags: int) -> bool:
        return self._map.status is not None and _any(flags, self._map.status.fault)

    def _absurd(self, shown: float, exchanged: list[float]) -> str:
        said = f"reads {shown:.3g} {self._unit} with its words in the order {self._order}, which is no weight"
        if self._reading.count == 2 and sane(exchanged, self._largest()):
            order = other(self._order)
            return f'{said}, but {exchanged[-1]:.6g} {self._unit} in the order {order}: set word_order = "{order}"'
        return f"{said}, nor is it one in the other order: check map and reading, or give range_max"

    # -- scale -------------------------------------------------------------------------------------------------------

    def _newtons(self) -> float:
        return NEWTONS_PER_UNIT[self._unit] if self._unit else math.nan

    def _largest(self) -> float:
        """In the unit shown."""
        ends = [abs(end) for end in (self._options.range_min, self._options.range_max) if end is not None]
        return BEYOND * max(ends, default=LARGEST) / self._newtons()

    def _quantum(self) -> float | None:
        """N"""
        if self._options.resolution is not None or self._unit is None or self._reading.type == "float32":
            return self._options.resolution
        if self._division is None and self._options.decimals is None:
            return None
        return (self._division or 10.0**-self._decimals) * self._newtons()

    def _calibration(self) -> dict[str, object]:
        reading, options = self._reading, self._options
        return {
            "formula": "thrust = sign * number on the wire / 10^decimals * newtons per unit (standard gravity 9.80665)",
            "sign": options.sign, "gain_std": options.gain_std, "unit": self._unit, "decimals": self._decimals,
            "map": self._map.title, "function": self._map.function, "register": reading.register,
            "type": reading.type, "word_order": self._order,
        }  # fmt: skip


def _any(flags: int, bits: tuple[int, ...]) -> bool:
    return any(flags >> bit & 1 for bit in bits)
