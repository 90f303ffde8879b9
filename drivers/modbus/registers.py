"""Any device on Modbus RTU whose registers a map file makes channels: power meter, thermometer, digital inputs.

Polled. Channels that one request reads are one row of one stream; those that need another request are a stream of
their own, for they were not measured at the same time.
"""

from __future__ import annotations

import contextlib
import json
from dataclasses import dataclass

from drivers.errors import DeviceError
from drivers.modbus.maps import WordOrder
from drivers.modbus.poll import ModbusPoll
from drivers.modbus.register_map import Block, ChannelMap, RegisterChannel, blocks, load_channels
from drivers.modbus.rtu import GAP_CHARACTERS, REPLY_OVERHEAD, REQUEST_CHARACTERS, Read, Registers, Unreadable
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import HOST_DELAY_STD, check_acquisition, check_line_rate, line_time
from drivers.ports.serial_port import SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind modbus_registers."""

    port: str
    map: str
    """Path of a .toml file."""
    rate: float
    """Polls/s of all channels."""
    baud: int = 9600
    framing: str = "8N1"
    address: int = 1
    channels: tuple[str, ...] = ()
    """Those of the map that are read; none: all."""
    word_order: WordOrder | None = None
    """Of two registers; None: the map's."""
    delay: float = 0.0
    """s by which a value is behind the quantity, without the line: filter, half a conversion period, turnaround."""
    delay_std: float = HOST_DELAY_STD
    """s, 1 sigma, of this delay and the computer's."""
    timeout: float = 0.25
    """s for a reply."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        if not self.map.endswith(".toml"):
            raise ValueError(f"modbus_registers map must be the path of a .toml file, not {self.map!r}")
        if self.word_order not in (None, "high_first", "low_first"):
            raise ValueError(f"modbus_registers word_order must be high_first or low_first, not {self.word_order!r}")
        found = load_channels(self.map)
        for name in self.channels:
            if name not in found.channels:
                raise ValueError(
                    f"modbus_registers channels: the map {self.map} has {', '.join(found.channels)}, not {name!r}"
                )
        needed = blocks(found, self.wanted)
        for block in needed:
            Read(self.address, found.function, block.register, block.registers)
        characters = sum(REQUEST_CHARACTERS + reply_characters(each) + round(2 * GAP_CHARACTERS) for each in needed)
        check_line_rate("modbus_registers", self.rate, self.baud, self.framing, characters)
        check_acquisition("modbus_registers", delay=self.delay, delay_std=self.delay_std)
        if not 0.0 < self.timeout <= 10.0:
            raise ValueError(f"modbus_registers timeout must be between 0 and 10 s, not {self.timeout}")

    @property
    def wanted(self) -> tuple[str, ...]:
        return self.channels or tuple(load_channels(self.map).channels)


def reply_characters(block: Block) -> int:
    return REPLY_OVERHEAD + 2 * block.registers


class ModbusRegisters:
    """Streams `<name>`, `<name>_2` ...: one a request, with the channels that it reads."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._map: ChannelMap = load_channels(options.map)
        self._order: WordOrder = options.word_order or self._map.word_order
        self._blocks = blocks(self._map, options.wanted)
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._poll = ModbusPoll(name, settings, options.timeout, wire)
        self._bad = BadRecords()

    @property
    def streams(self) -> tuple[Stream, ...]:
        return tuple(
            Stream(
                self._stream(at), "modbus_registers",
                tuple(self._channel(name, block) for name in block.names), 1.0 / self._options.rate,
            )
            for at, block in enumerate(self._blocks)
        )  # fmt: skip

    def open(self) -> str:
        """Asks once for everything, begins to poll. Raises LinkError, or DeviceError when nobody answers."""
        self._bad = BadRecords()
        requests = [
            Read(self._options.address, self._map.function, each.register, each.registers) for each in self._blocks
        ]
        self._poll.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            for request in requests:
                self._ask(request)
            self._poll.start(requests, self._options.rate)
            undo.pop_all()
        return f"{self._map.title}, Modbus address {self._options.address} (serial number not read)"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, record in self._poll.take():
            if isinstance(record, Registers):
                at = next(i for i, block in enumerate(self._blocks) if block.register == record.register)
                samples.append(Sample(self._stream(at), t_ns, self._values(self._blocks[at], record.words)))
            else:
                self._bad.add(record.text if isinstance(record, Unreadable) else str(record))
        return samples

    def health(self) -> LinkHealth:
        poll, bad = self._poll, self._bad
        return LinkHealth(poll.alive, poll.received, bad.count, bad.first, poll.error, poll.dropped)

    def close(self) -> None:
        self._poll.close()

    def _ask(self, request: Read) -> None:
        try:
            self._poll.ask(request)
        except DeviceError as error:
            raise DeviceError(f"{error}: check address, baud and framing, and the map {self._options.map}") from error

    def _stream(self, at: int) -> str:
        return self.name if at == 0 else f"{self.name}_{at + 1}"

    def _values(self, block: Block, words: tuple[int, ...]) -> tuple[float, ...]:
        channels = [self._map.channels[name] for name in block.names]
        begins = [channel.register - block.register for channel in channels]
        return tuple(
            channel.value(words[at : at + channel.count], self._order)
            for channel, at in zip(channels, begins, strict=True)
        )

    def _channel(self, name: str, block: Block) -> Channel:
        options, found = self._options, self._map.channels[name]
        on_the_line = line_time(options.baud, options.framing, reply_characters(block))
        return Channel(
            name, found.quantity, found.unit, noise_std=found.noise_std, quantum=_quantum(found),
            delay=options.delay + on_the_line, delay_std=options.delay_std, range_min=found.range_min,
            range_max=found.range_max, calibration=self._calibration(found), description=self._map.title,
        )  # fmt: skip

    def _calibration(self, found: RegisterChannel) -> str:
        return json.dumps({
            "formula": "value = scale * number + offset", "scale": found.scale, "offset": found.offset,
            "function": self._map.function, "register": found.register, "type": found.type, "bit": found.bit,
            "word_order": self._order,
        })  # fmt: skip


def _quantum(found: RegisterChannel) -> float | None:
    return None if found.type == "float32" or found.bit is not None else abs(found.scale)
