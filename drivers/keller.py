"""Water temperature and pressure from a Keller transmitter (33X, 35X, PD-33X and other X-line) by Modbus RTU.

Source: Keller, Description of the Communication Protocol, X-line 3.7: function 3, float32 big endian, high word first;
0x0002 P1 [bar], 0x0008 TOB1 [degC]; 9600 8N1. The instrument is polled by a thread of its own.
"""

from __future__ import annotations

import contextlib
import struct
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drivers.errors import DeviceError, LinkError
from drivers.ports.inbox import BadRecords, Inbox
from drivers.ports.lines import check_line_rate
from drivers.protocols import Channel, LinkHealth, Sample, Stream

if TYPE_CHECKING:
    from pymodbus.client import ModbusSerialClient

P1, TOB1 = 0x0002, 0x0008
"""Register addresses as on the wire."""
PASCAL_PER_BAR = 1e5
POLL_CHARACTERS = 2 * (8 + 9) + 2 * 14
"""Two requests of 8 and two replies of 9 characters, four gaps of 3.5 (Modbus over serial line 1.02, 2.5.1.1)."""
JOIN_MARGIN = 2.0
"""s beyond the reply timeout that the polling thread gets to stop."""


def decode_float(registers: Sequence[int]) -> float:
    """Two registers, high word first, to a float32. Raises ValueError for another number of registers."""
    if len(registers) != 2:
        raise ValueError(f"a float32 takes 2 registers, came {len(registers)}")
    value: float = struct.unpack(">f", struct.pack(">HH", *registers))[0]
    return value


def encode_float(value: float) -> list[int]:
    """A float32 as two registers, high word first."""
    return list(struct.unpack(">HH", struct.pack(">f", value)))


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind keller."""

    port: str
    rate: float = 2.0
    """Polls/s."""
    baud: int = 9600
    address: int = 1
    timeout: float = 0.5
    """s for a reply."""

    def __post_init__(self) -> None:
        if not self.port:
            raise ValueError("keller port is empty: give a device path such as /dev/ttyUSB0")
        check_line_rate("keller", self.rate, self.baud, "8N1", POLL_CHARACTERS)
        if not 1 <= self.address <= 247:
            raise ValueError(f"keller address must be 1 to 247 (Modbus), not {self.address}")
        if not 0.0 < self.timeout <= 10.0:
            raise ValueError(f"keller timeout must be between 0 and 10 s, not {self.timeout}")


class Keller:
    """Stream `<name>`: `water_temperature` [degC] and `pressure` [Pa]."""

    def __init__(self, name: str, options: Options) -> None:
        self.name = name
        self._options = options
        self._inbox: Inbox[tuple[float, float]] = Inbox(10_000)
        self._bad = BadRecords()
        self._error: str | None = None
        self._client: ModbusSerialClient | None = None
        self._poller: threading.Thread | None = None
        self._closing = threading.Event()

    @property
    def streams(self) -> tuple[Stream, ...]:
        temperature = Channel("water_temperature", "water_temperature", "degC", description="TOB1")
        pressure = Channel("pressure", None, "Pa", description="P1")
        return (Stream(self.name, "keller", (temperature, pressure), 1.0 / self._options.rate),)

    def open(self) -> str:
        """Opens the port and asks once. Raises LinkError, or DeviceError when nobody answers."""
        from pymodbus.client import ModbusSerialClient

        self.close()
        options = self._options
        self._closing.clear()
        self._error, self._bad, self._inbox = None, BadRecords(), Inbox(10_000)
        client = ModbusSerialClient(options.port, baudrate=options.baud, timeout=options.timeout, retries=0)
        if not client.connect():
            raise LinkError(
                f"{self.name}: cannot open {options.port}: check cable, path, and that no other program has it open"
            )
        with contextlib.ExitStack() as undo:
            undo.callback(client.close)
            self._identify(client)
            undo.pop_all()
        self._client = client
        self._poller = threading.Thread(target=self._poll, args=(client,), name=f"poll {self.name}", daemon=False)
        self._poller.start()
        return f"Keller transmitter, Modbus address {options.address} (serial number not read)"

    def drain(self) -> list[Sample]:
        return [Sample(self.name, t_ns, values) for t_ns, values in self._inbox.take_all()]

    def health(self) -> LinkHealth:
        alive = self._poller is not None and self._error is None
        inbox, bad = self._inbox, self._bad
        return LinkHealth(alive, inbox.received, bad.count, bad.first, self._error, inbox.dropped)

    def close(self) -> None:
        self._closing.set()
        if self._poller is not None:
            self._poller.join(2.0 * self._options.timeout + JOIN_MARGIN)
        if self._client is not None:
            self._client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it unannotated
        self._client = self._poller = None

    def _identify(self, client: ModbusSerialClient) -> None:
        """Asked twice: the first answer may meet the rest of an old conversation."""
        from pymodbus.exceptions import ModbusException

        for last in (False, True):
            try:
                self._read(client)
            except (ModbusException, ValueError, OSError) as error:
                if last:
                    raise DeviceError(
                        f"{self.name}: no Keller transmitter answers at address {self._options.address} on"
                        f" {self._options.port}, {self._options.baud} 8N1 ({error}): check address, baud and power"
                    ) from error
            else:
                return

    def _poll(self, client: ModbusSerialClient) -> None:
        from pymodbus.exceptions import ConnectionException, ModbusException

        end: str | None = f"the poller of {self._options.port} stopped on an error of this program (see the log)"
        due = time.monotonic()
        try:
            while not self._closing.wait(max(0.0, due - time.monotonic())):
                due = max(due + 1.0 / self._options.rate, time.monotonic())
                try:
                    values = self._read(client)
                except ConnectionException:
                    raise
                except (ModbusException, ValueError) as error:
                    self._bad.add(str(error))
                else:
                    self._inbox.put(time.monotonic_ns(), (values,))
            end = None
        except (ConnectionException, OSError) as error:
            end = f"{self._options.port} was lost ({error}): check cable and power, then open it again"
        finally:
            self._error = end
            self._inbox.end()

    def _read(self, client: ModbusSerialClient) -> tuple[float, float]:
        """Temperature in degC, pressure in Pa. A late reply cannot be taken for the next: a failed poll ends here."""
        temperature = self._read_float(client, TOB1)
        return temperature, self._read_float(client, P1) * PASCAL_PER_BAR

    def _read_float(self, client: ModbusSerialClient, address: int) -> float:
        reply = client.read_holding_registers(address, count=2, device_id=self._options.address)
        if reply.isError():
            raise ValueError(f"register 0x{address:04X}: {reply}")
        return decode_float(reply.registers)
