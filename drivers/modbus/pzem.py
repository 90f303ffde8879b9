"""Voltage, current and power of a DC supply from a Peacefair PZEM-003 or PZEM-017 by Modbus RTU.

Source: Peacefair, PZEM-003/017 DC communication module, user manual: 9600 8N2; input registers (function 4) 0 voltage
(0.01 V), 1 current (0.01 A), 2 and 3 power (0.1 W, low word first), 4 and 5 energy (Wh), 6 and 7 alarm of high and low
voltage (FFFF: on); holding register 3 of a PZEM-017 the shunt. It renews its values about once a second: they are for
limits and for power, not for transients.
"""

from __future__ import annotations

import contextlib
import json
from dataclasses import dataclass

from drivers.errors import DeviceError
from drivers.modbus.poll import ModbusPoll
from drivers.modbus.rtu import REQUEST_CHARACTERS, Read, Registers, Unreadable
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import check_acquisition, check_gain_std, check_line_rate, line_time
from drivers.ports.serial_port import SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream

FRAMING = "8N2"
REGISTERS = 8
SHUNT_REGISTER = 3
SHUNTS = {100: 0, 50: 1, 200: 2, 300: 3}
"""Code in the shunt's register, by its A."""
VOLT, AMPERE, WATT = 0.01, 0.01, 0.1
"""Per count."""
POLL_CHARACTERS = REQUEST_CHARACTERS + 5 + 2 * REGISTERS + 7
"""Request, reply, and two gaps of 3.5."""


class Reading(tuple[float, float, float, float, int, int]):
    """V, A, W, Wh, and the two alarms, 1 is on."""

    __slots__ = ()


def decode(words: tuple[int, ...]) -> Reading:
    """The eight registers. Raises ValueError for another number of them."""
    if len(words) != REGISTERS:
        raise ValueError(f"a PZEM's values are {REGISTERS} registers, came {len(words)}")
    volts, amps, power, power_high, energy, energy_high, high, low = words
    return Reading(
        (
            volts * VOLT,
            amps * AMPERE,
            (power | power_high << 16) * WATT,
            float(energy | energy_high << 16),
            int(high != 0),
            int(low != 0),
        )
    )


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind pzem."""

    port: str
    rate: float = 5.0
    """Polls/s; the meter renews its values about once a second."""
    baud: int = 9600
    address: int = 1
    shunt: int | None = None
    """A, of a PZEM-017: 50, 100, 200 or 300; compared with the meter's own setting. None: not compared."""
    gain_std: float | None = None
    """Relative standard uncertainty (1 sigma) of the current; the manual says 1 % of it for the meter alone."""
    delay: float = 0.5
    """s by which a value is behind the quantity: half of the time between two renewals."""
    delay_std: float = 0.3
    """s, 1 sigma."""
    timeout: float = 0.5
    """s for a reply."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, FRAMING)
        check_line_rate("pzem", self.rate, self.baud, FRAMING, POLL_CHARACTERS)
        if not 1 <= self.address <= 247:
            raise ValueError(f"pzem address must be 1 to 247 (Modbus), not {self.address}")
        if self.shunt is not None and self.shunt not in SHUNTS:
            raise ValueError(f"pzem shunt must be one of {', '.join(map(str, SHUNTS))} A, not {self.shunt}")
        check_gain_std("pzem", self.gain_std)
        check_acquisition("pzem", delay=self.delay, delay_std=self.delay_std)
        if not 0.0 < self.timeout <= 10.0:
            raise ValueError(f"pzem timeout must be between 0 and 10 s, not {self.timeout}")


class Pzem:
    """Stream `<name>`: `bus_voltage` [V], `current` [A] and `power` [W] of the supply, `energy`, `alarm`."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        settings = SerialSettings(options.port, options.baud, FRAMING, options.capture)
        self._poll = ModbusPoll(name, settings, options.timeout, wire)
        self._request = Read(options.address, 4, 0, REGISTERS)
        self._bad = BadRecords()

    @property
    def streams(self) -> tuple[Stream, ...]:
        o = self._options
        late = o.delay + line_time(o.baud, FRAMING, self._request.reply_characters)
        calibration = json.dumps({"formula": "current = counts * 0.01 A", "gain_std": o.gain_std, "shunt": o.shunt})
        channels = (
            Channel("bus_voltage", "bus_voltage", "V", quantum=VOLT, delay=late, delay_std=o.delay_std),
            Channel(
                "current", "current", "A", quantum=AMPERE, delay=late, delay_std=o.delay_std, calibration=calibration,
                description="of the supply, never negative; what is below 0.02 A is told as 0",
            ),
            Channel("power", None, "W", quantum=WATT, delay=late, delay_std=o.delay_std, description="of the supply"),
            Channel("energy", None, "W h", quantum=1.0, description="since it was last reset"),
            Channel("alarm", None, "1", integer=True, description="1: voltage too high, 2: too low, by its thresholds"),
        )  # fmt: skip
        return (Stream(self.name, "pzem", channels, 1.0 / o.rate),)

    def open(self) -> str:
        """Opens the port, asks once, and compares the shunt. Raises LinkError, or DeviceError."""
        self._bad = BadRecords()
        self._poll.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._require_values()
            shunt = self._require_shunt()
            self._poll.start([self._request], self._options.rate)
            undo.pop_all()
        return f"Peacefair PZEM DC meter, Modbus address {self._options.address}{shunt} (serial number not read)"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, record in self._poll.take():
            if isinstance(record, Registers):
                volts, amps, power, energy, high, low = decode(record.words)
                samples.append(Sample(self.name, t_ns, (volts, amps, power, energy, float(high + 2 * low))))
            else:
                self._bad.add(record.text if isinstance(record, Unreadable) else str(record))
        return samples

    def health(self) -> LinkHealth:
        poll, bad = self._poll, self._bad
        return LinkHealth(poll.alive, poll.received, bad.count, bad.first, poll.error, poll.dropped)

    def close(self) -> None:
        self._poll.close()

    def _require_values(self) -> None:
        o = self._options
        try:
            self._poll.ask(self._request)
        except DeviceError as error:
            why = str(error).rpartition(": ")[2]
            raise DeviceError(
                f"{self.name}: no PZEM DC meter answers at address {o.address} on {o.port}, {o.baud} {FRAMING} ({why}):"
                " check address and wiring, and that it has its 5 V (a bus below 7 V does not feed it)"
            ) from error

    def _require_shunt(self) -> str:
        """What the identity says of it; a meter that was set to another shunt tells currents that are wrong by their
        ratio."""
        o = self._options
        if o.shunt is None:
            return ""
        (code,) = self._poll.ask(Read(o.address, 3, SHUNT_REGISTER, 1)).words
        if code != SHUNTS[o.shunt]:
            found = next((f"{amps} A" for amps, known in SHUNTS.items() if known == code), f"code {code}")
            raise DeviceError(
                f"{self.name}: the meter is set to a shunt of {found}, the bench file says shunt = {o.shunt} A: every"
                " current would be wrong by their ratio; set its register 3, or correct the bench file"
            )
        return f", shunt of {o.shunt} A"
