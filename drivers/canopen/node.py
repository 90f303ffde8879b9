"""One CANopen device on a bus: objects read, written and read back, PDOs laid out, its frames in one inbox."""

from __future__ import annotations

from collections.abc import Callable

from drivers.canopen.frames import PRE_OPERATIONAL, RECEIVE_PDO, SEND_PDO, START, Field, nmt
from drivers.canopen.sdo import ABSENT, SdoAbortedError, SdoCommunicationError, SdoOverBus
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import Inbox

DISABLED, COB_ID = 1 << 31, 0x7FF
"""Of a PDO's communication parameter 1."""
BY_EVENT = 255
"""Transmission type: by the device's profile, here a timer."""


class CanopenNode:
    """`name` begins its sentences. `open` before anything else."""

    def __init__(self, name: str, node_id: int, bus: CanBus, timeout: float) -> None:
        """`timeout`: s for each reply."""
        self._name, self.id, self._bus, self._timeout = name, node_id, bus, timeout
        self.inbox: Inbox[Frame] = Inbox(1)
        self._sdo = SdoOverBus(node_id, bus, self.inbox, timeout)

    def open(self) -> None:
        """Needs the bus open. Sends nothing."""
        self.close()
        self.inbox = self._bus.subscribe(self._is_ours)
        self._sdo = SdoOverBus(self.id, self._bus, self.inbox, self._timeout)

    def close(self) -> None:
        """Leave the bus, which belongs to whoever opened it."""
        self._bus.unsubscribe(self.inbox)

    def require_profile(self, profile: int) -> None:
        """The device is there and of CiA `profile`. Raises DeviceError, LinkError."""
        try:
            found = self.number(0x1000)
        except DeviceError as error:
            raise DeviceError(
                f"{self._name}: no CANopen device answers as node {self.id} within {self._timeout:g} s: check node_id,"
                f" bit rate, termination and power ({error})"
            ) from error
        if found & 0xFFFF != profile:
            raise DeviceError(
                f"{self._name}: node {self.id} is a device of CiA {found & 0xFFFF} (object 0x1000 is 0x{found:08X}),"
                f" expected CiA {profile}: check node_id and kind"
            )

    def identity(self) -> str:
        """Its name, vendor, product, revision and serial number, as far as it tells them."""
        told = self._read_if_there(0x1008, 0)
        name = "" if told is None else told.split(b"\0")[0].decode("ascii", "replace").strip()
        numbers = [self.number_if_there(0x1018, sub) for sub in (1, 2, 3, 4)]
        words = ("vendor", "product", "revision", "serial")
        known = [f"{word} 0x{number:X}" for word, number in zip(words, numbers, strict=True) if number]
        return ", ".join([name or f"CANopen node {self.id}", *known])

    # -- objects -----------------------------------------------------------------------------------------------------

    def number(self, index: int, sub: int = 0, *, signed: bool = False) -> int:
        """Value of an object. Raises DeviceError with the device's own reason, LinkError."""
        return int.from_bytes(self._read(index, sub), "little", signed=signed)

    def number_if_there(self, index: int, sub: int = 0, *, signed: bool = False) -> int | None:
        """None: the device has no such object."""
        data = self._read_if_there(index, sub)
        return None if data is None else int.from_bytes(data, "little", signed=signed)

    def size(self, index: int, sub: int = 0) -> int:
        """Bytes that an object has. Raises DeviceError, LinkError."""
        return len(self._read(index, sub))

    def write(self, field: Field, value: int, what: str) -> None:
        """Write an object. `what` says in the sentence what it is for. Raises DeviceError, LinkError."""
        data = value.to_bytes(field.bits // 8, "little", signed=field.signed)
        try:
            self._sdo.download(field.index, field.sub, data)
        except SdoAbortedError as error:
            raise DeviceError(f"{self._of(field, what)} refuses {value}: {error}") from error
        except SdoCommunicationError as error:
            raise DeviceError(f"{self._of(field, what)} does not answer a write of {value}: {error}") from error

    def set(self, field: Field, value: int, what: str, mask: int = -1) -> None:
        """Write an object and read it back, compared under `mask`. Raises DeviceError when it is another, LinkError."""
        self.write(field, value, what)
        found = self.number(field.index, field.sub, signed=field.signed)
        if found & mask != value & mask:
            raise DeviceError(
                f"{self._of(field, what)} was set to {value} and reads back {found}: the device does not take this"
                " setting; set it by the maker's tool, or correct the bench file"
            )

    def _of(self, field: Field, what: str) -> str:
        return f"{self._name}: object 0x{field.index:04X}:{field.sub} ({what})"

    def _read(self, index: int, sub: int) -> bytes:
        try:
            return bytes(self._sdo.upload(index, sub))
        except (SdoAbortedError, SdoCommunicationError) as error:
            raise DeviceError(f"{self._name}: object 0x{index:04X}:{sub} can't be read: {error}") from error

    def _read_if_there(self, index: int, sub: int) -> bytes | None:
        try:
            return bytes(self._sdo.upload(index, sub))
        except SdoAbortedError as error:
            if error.code in ABSENT:
                return None
            raise DeviceError(f"{self._name}: object 0x{index:04X}:{sub} can't be read: {error}") from error
        except SdoCommunicationError as error:
            raise DeviceError(f"{self._name}: object 0x{index:04X}:{sub} can't be read: {error}") from error

    # -- PDOs --------------------------------------------------------------------------------------------------------

    def lay_out_sent(
        self, number: int, fields: tuple[Field, ...], period_ms: int | None, transmission: int = BY_EVENT
    ) -> None:
        """TPDO `number` (1 to 4): these fields every `period_ms`, no more often; None: by `transmission` alone."""
        self._lay_out(0x1800 + number - 1, SEND_PDO[number - 1], fields, period_ms, transmission)

    def lay_out_received(self, number: int, fields: tuple[Field, ...]) -> None:
        """RPDO `number` (1 to 4): these fields, obeyed as they come."""
        self._lay_out(0x1400 + number - 1, RECEIVE_PDO[number - 1], fields, None, BY_EVENT)

    def _lay_out(
        self, index: int, function: int, fields: tuple[Field, ...], period_ms: int | None, transmission: int
    ) -> None:
        """CiA 301: switch off, empty the mapping, write it, count it, switch on. Every value is read back."""
        what = f"{'TPDO' if index >= 0x1800 else 'RPDO'} {(index & 0x1FF) + 1}"
        cob = Field(index, 1, 32)
        other = self.number(index, 1) & ~(DISABLED | COB_ID)  # bit 30 of a TPDO: no remote frames
        wanted = other | function + self.id
        self.set(cob, wanted | DISABLED, what, DISABLED | COB_ID)
        count = Field(index + 0x200, 0, 8)
        self.set(count, 0, what)
        for sub, field in enumerate(fields, 1):
            self.set(Field(index + 0x200, sub, 32), field.mapping, f"{what}, which shall hold 0x{field.index:04X}")
        self.set(count, len(fields), what)
        self.set(Field(index, 2, 8), transmission, f"transmission type of {what}")
        if period_ms is not None:
            self.set(Field(index, 3, 16), 10 * period_ms, f"inhibit time of {what}, 0.1 ms")
            self.set(Field(index, 5, 16), period_ms, f"event timer of {what}, ms")
        self.set(cob, wanted, what, DISABLED | COB_ID)

    # -- frames ------------------------------------------------------------------------------------------------------

    def hold(self) -> None:
        """Pre-operational: no PDOs, and they may be laid out."""
        self._bus.send(nmt(PRE_OPERATIONAL, self.id))

    def start(self) -> None:
        """Operational: PDOs come and are obeyed."""
        self._bus.send(nmt(START, self.id))

    def expect(self, match: Callable[[Frame], bool], seconds: float, missing: str) -> None:
        """Wait for a frame, which stays in the inbox. Raises DeviceError saying `missing`, LinkError."""
        if self.inbox.wait_for(match, seconds, take=False) is not None:
            return
        if not self._bus.alive:
            raise LinkError(f"{self._name}: {self._bus.error or 'its CAN bus was closed'}")
        raise DeviceError(f"{self._name}: {missing}")

    def _is_ours(self, frame: Frame) -> bool:
        return not frame.extended and frame.id & 0x7F == self.id and 0x080 < frame.id < 0x780
