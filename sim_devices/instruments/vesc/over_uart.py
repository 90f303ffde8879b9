"""Device side of a VESC on a serial line: the controller of controller.py behind the packets of comm/packet.c.

`02 length payload crc crc 03` up to 255 bytes, `03 length length payload crc crc 03` above; CRC-16 XMODEM over the
payload. What does not fit costs one byte, and it is tried again from the next (github.com/vedderb/bldc comm/packet.c).
"""

from __future__ import annotations

from dataclasses import dataclass

from sim_devices.instruments.vesc.codec import crc16
from sim_devices.instruments.vesc.controller import Vesc, VescOptions
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

MOST = 512
"""bytes of a payload, PACKET_MAX_PL_LEN."""


@dataclass(frozen=True, slots=True)
class VescUartOptions:
    """`[devices.<name>]` of kind vesc_uart."""

    kind: str
    port: str
    baud: int = 115200
    vesc_id: int = 23
    pole_pairs: int = 7
    timeout: float = 1.0
    """s; 0 disables the watchdog."""
    brake_current: float = 0.0
    """A after the timeout; 0: coasts."""
    broken_watchdog: bool = False
    """The timeout is configured and never fires."""
    max_current: float = 60.0
    """A."""
    uuid: str = "53494d2d564553432d303032"
    """12 bytes, hexadecimal."""

    def __post_init__(self) -> None:
        self.controller()

    def controller(self) -> VescOptions:
        """The same, of a controller that broadcasts nothing."""
        return VescOptions(
            "vesc", self.vesc_id, self.pole_pairs, self.timeout, self.brake_current, self.broken_watchdog,
            self.max_current, uuid=self.uuid,
        )  # fmt: skip


class VescUart:
    """A `vesc` on a line of its own."""

    def __init__(self, vesc: Vesc) -> None:
        self.vesc = vesc
        self.faults = vesc.faults
        self._rest = b""

    @property
    def due(self) -> float:
        return self.vesc.due

    def drive(self, n: float, dt: float) -> tuple[float | None, float]:
        return self.vesc.drive(n, dt)

    def tick(self, t: float) -> bytes:
        """Its boot and its watchdog; it says nothing by itself."""
        self.vesc.tick(t)
        return b""

    def feed(self, data: bytes, t: float) -> bytes:
        self.tick(t)
        self._rest += data
        said = b""
        while self._rest:
            payload, used = packet(self._rest)
            if not used:
                break
            self._rest = self._rest[used:]
            if payload and (reply := self.vesc.answer(payload, t)):
                said += wrapped(reply)
        return said

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        self.vesc.fault(name, t, amount)

    def clear(self, t: float) -> None:
        self.vesc.clear(t)


def wrapped(payload: bytes) -> bytes:
    """A packet."""
    size = len(payload)
    head = bytes((2, size)) if size <= 0xFF else b"\x03" + size.to_bytes(2, "big")
    return head + payload + crc16(payload).to_bytes(2, "big") + b"\x03"


def packet(data: bytes) -> tuple[bytes, int]:
    """(payload, bytes used) at the beginning of `data`; 1 byte and no payload: none begins here; 0: more is needed."""
    if data[0] not in (2, 3):
        return b"", 1
    head = data[0]
    if len(data) < head:
        return b"", 0
    size = int.from_bytes(data[1:head], "big")
    if not 1 <= size <= MOST:
        return b"", 1
    end = head + size
    if len(data) < end + 3:
        return b"", 0
    if data[end + 2] != 3 or crc16(data[head:end]) != int.from_bytes(data[end : end + 2], "big"):
        return b"", 1
    return data[head:end], end + 3
