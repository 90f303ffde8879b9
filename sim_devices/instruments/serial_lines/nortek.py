"""Device side of a Nortek current meter in averaging mode, NMEA telemetry over a serial line.

Source: Nortek Signature Integrator's Guide, section 7.1.2 (DF=101) and 7.1.3 (DF=103). Checksum: XOR of the
characters between `$` and `*`, two hexadecimal digits.

`$PNORC1,MMDDYY,hhmmss,cell,position,v1,v2,v3,v4,a1,a2,a3,a4,c1,c2,c3,c4*hh`: cell number, distance (m),
velocities (m/s, signed; coordinate system XYZ with four beams: X, Y, Z1, Z2), amplitudes (dB), correlations (%).
This is the sentence sent, because it carries signed components: **X points down the tunnel, so v1 is the flow speed,
positive when the water comes at the thruster from ahead.** Y, Z1 and Z2 carry only noise.

`$PNORC3,CP=4.5,SP=3.519,DIR=110.9,AC=6,AA=28*3B`: position, speed (never negative), direction (deg from X, 0..360),
mean correlation, mean amplitude. On request (`sentences = ["PNORC3"]`); the sign is in the direction (180 = astern).

Invalid data are variants of -9 (section 7.1.1): -9.000.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import reduce
from math import inf, isnan

from sim_devices.tables import WorldError
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

SENTENCES = ("PNORC1", "PNORC3")
CELL, POSITION = 1, 0.5
AMPLITUDE, CORRELATION = 68.0, 97
"""dB and %, of a clean tunnel with seeding."""
LOST_AMPLITUDE, LOST_CORRELATION = 24.0, 12
"""The same with nothing to see."""


@dataclass(frozen=True, slots=True)
class NortekOptions:
    """`[devices.<name>]` of kind nortek."""

    kind: str
    port: str
    baud: int = 9600
    rate: float = 4.0
    """sentences/s."""
    sentences: tuple[str, ...] = ("PNORC1",)

    def __post_init__(self) -> None:
        if self.rate <= 0 or not set(self.sentences) <= set(SENTENCES):
            raise ValueError(f"rate must be positive and sentences among {', '.join(SENTENCES)}")
        if self.rate * 100 * len(self.sentences) * 10 > self.baud:
            raise WorldError(f"nortek: {self.rate} sentences/s of about 100 characters do not fit {self.baud} baud")


def sentence(body: str) -> bytes:
    """`$body*hh` CRLF."""
    checksum = reduce(lambda a, b: a ^ b, body.encode("ascii"), 0)
    return f"${body}*{checksum:02X}\r\n".encode("ascii")


def pnorc1(when: datetime, velocities: tuple[float, ...], amplitude: float, correlation: int) -> bytes:
    """DF=101, one cell. Velocities in m/s, NaN is sent as -9.000."""
    speeds = [f"{-9.0 if isnan(v) else v:.3f}" for v in velocities]
    beams = len(speeds)
    fields = [f"{when:%m%d%y}", f"{when:%H%M%S}", str(CELL), f"{POSITION:.1f}", *speeds]
    return sentence(",".join(["PNORC1", *fields, *[f"{amplitude:.1f}"] * beams, *[str(correlation)] * beams]))


def pnorc3(speed: float, direction: float, amplitude: float, correlation: int, position: float = POSITION) -> bytes:
    """DF=103, one cell. Speed in m/s >= 0, direction in deg."""
    return sentence(f"PNORC3,CP={position:.1f},SP={speed:.3f},DIR={direction:.1f},AC={correlation},AA={amplitude:.0f}")


class Nortek:
    """One current meter. `read` gives the flow speed (m/s) and, again called, the noise of a cross component."""

    faults = ("frozen", "silent", "no_echo")

    def __init__(
        self, options: NortekOptions, read: Callable[[], float], cross: Callable[[], float], epoch: datetime
    ) -> None:
        """`epoch`: UTC at t = 0, as the instrument's own clock has it."""
        self._options, self._read, self._cross = options, read, cross
        self._epoch = epoch.astimezone(UTC).timestamp()
        self._next = 0.0
        self._fault = ""
        self._last = (read(), 0.0, 0.0, 0.0)

    @property
    def due(self) -> float:
        return inf if self._fault == "silent" else self._next

    def feed(self, _data: bytes, _t: float) -> bytes:
        """The meter measures by itself and takes no commands while it does: what it is sent is ignored."""
        return b""

    def tick(self, t: float) -> bytes:
        out = b""
        while self._next <= t:
            when = datetime.fromtimestamp(self._epoch + self._next, UTC)
            self._next += 1.0 / self._options.rate
            out += b"".join(self._sentences(when))
        return b"" if self._fault == "silent" else out

    def _sentences(self, when: datetime) -> list[bytes]:
        lost = self._fault == "no_echo"
        if self._fault != "frozen":
            self._last = (self._read(), self._cross(), self._cross(), self._cross())
        speeds = (float("nan"),) * 4 if lost else self._last
        amplitude = LOST_AMPLITUDE if lost else AMPLITUDE
        correlation = LOST_CORRELATION if lost else CORRELATION
        made = []
        for name in self._options.sentences:
            if name == "PNORC1":
                made.append(pnorc1(when, speeds, amplitude, correlation))
            else:
                x = speeds[0]
                made.append(pnorc3(9.0 if isnan(x) else abs(x), 0.0 if x >= 0 else 180.0, amplitude, correlation))
        return made

    def fault(self, name: str, _t: float, _amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"flow meter: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault = name

    def clear(self, t: float) -> None:
        self._fault = ""
        self._next = max(self._next, t)
