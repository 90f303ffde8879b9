"""Signals of a CAN bus as channels: a torque cell, a battery monitor, a safety controller; whatever a DBC describes.

Nothing is sent. Each message is a stream of its own, a row a frame.
"""

from __future__ import annotations

import contextlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drivers.can_signals.signal_map import SignalChannel, load_signals, signal_of
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords, Inbox
from drivers.ports.lines import HOST_DELAY_STD, check_acquisition
from drivers.protocols import QUARTZ, Channel, LinkHealth, Sample, Stream

if TYPE_CHECKING:
    from cantools.database.can import Message

PERIODS = 3.0
"""Of a message: so long is waited for its first frame, and at least a second."""


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind can_signals."""

    bus: str
    map: str
    """Path of a .toml file, which names the DBC file."""
    delay: float = 0.0
    """s by which a value is behind the quantity: conversion, filter, transmission."""
    delay_std: float = HOST_DELAY_STD
    """s, 1 sigma, of this delay and the computer's."""

    def __post_init__(self) -> None:
        if not self.map.endswith(".toml"):
            raise ValueError(f"can_signals map must be the path of a .toml file, not {self.map!r}")
        load_signals(self.map)
        check_acquisition("can_signals", delay=self.delay, delay_std=self.delay_std)


class CanSignals:
    """Streams `<name>` (the first message of the map) and `<name>_<message>`: the channels of each."""

    def __init__(self, name: str, options: Options, bus: CanBus) -> None:
        self.name = name
        self._options, self._bus = options, bus
        self._map, self._messages = load_signals(options.map)
        first = next(iter(self._messages))
        self._streams = {m: name if m == first else f"{name}_{m.lower()}" for m in self._messages}
        self._by_id = {(m.frame_id, m.is_extended_frame): m for m in self._messages.values()}
        signals = {c.signal: signal_of(self._messages[c.message], c) for c in self._map.channels.values()}
        self._scales = {name: (float(each.scale), float(each.offset)) for name, each in signals.items()}
        self._inbox: Inbox[Frame] = Inbox(1)
        self._bad = BadRecords()
        self._open = False
        from cantools.database.errors import DecodeError

        self._refusal = DecodeError

    @property
    def streams(self) -> tuple[Stream, ...]:
        return tuple(
            Stream(
                self._streams[name], "can_signals",
                tuple(self._channel(each, channel, message) for each, channel in self._map.of_message(name).items()),
                1.0 / self._map.rates[name], QUARTZ,
            )
            for name, message in self._messages.items()
        )  # fmt: skip

    def open(self) -> str:
        """Needs the bus open. Waits for each message. Raises LinkError, or DeviceError for one that does not come."""
        self.close()
        self._bad = BadRecords()
        self._inbox = self._bus.subscribe(lambda frame: (frame.id, frame.extended) in self._by_id)
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            for name in self._messages:
                self._require(name)
            undo.pop_all()
        self._open = True
        return f"{self._map.title}: {', '.join(self._messages)} on {self._options.bus}"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, frame in self._inbox.take_all():
            message = self._by_id[(frame.id, frame.extended)]
            values = self._values(message, frame)
            if values is not None:
                samples.append(Sample(self._streams[message.name], t_ns, values))
            elif not message.is_multiplexed():
                self._bad.add(str(frame))
        return samples

    def health(self) -> LinkHealth:
        bus = self._bus.health()
        bad, first = bus.bad + self._bad.count, (*self._bad.first, *bus.first_bad)[:5]
        return LinkHealth(self._open and bus.alive, self._inbox.received, bad, first, bus.error, self._inbox.dropped)

    def close(self) -> None:
        """Leave the bus; the bus itself belongs to whoever opened it."""
        self._bus.unsubscribe(self._inbox)
        self._open = False

    def _require(self, name: str) -> None:
        message, wait = self._messages[name], max(1.0, PERIODS / self._map.rates[name])

        def is_row(frame: Frame) -> bool:
            return (frame.id, frame.extended) == (message.frame_id, message.is_extended_frame) and (
                self._values(message, frame) is not None
            )

        if self._inbox.wait_for(is_row, wait, take=False) is not None:
            return
        if not self._bus.alive:
            raise LinkError(f"{self.name}: {self._bus.error or 'its CAN bus was closed'}")
        wanted = ", ".join(channel.name_in_message for channel in self._map.of_message(name).values())
        identifier = f"{message.frame_id:X}{', 29 bits' if message.is_extended_frame else ''}"
        raise DeviceError(
            f"{self.name}: no frame of {name} (id {identifier}) with {wanted} came within {wait:g} s: check power, bit"
            " rate, the identifier in the device and the DBC file"
        )

    def _values(self, message: Message, frame: Frame) -> tuple[float, ...] | None:
        """The channels of a message in a frame; None where the frame is too short or has another multiplexer."""
        try:
            said = message.decode(frame.data, decode_choices=False, scaling=False)
        except self._refusal:
            return None
        channels = self._map.of_message(message.name).values()
        if not isinstance(said, dict) or any(channel.name_in_message not in said for channel in channels):
            return None
        return tuple(
            channel.value(float(str(said[channel.name_in_message])), *self._scales[channel.signal])
            for channel in channels
        )

    def _channel(self, name: str, channel: SignalChannel, message: Message) -> Channel:
        signal = signal_of(message, channel)
        ends = [channel.range_min, channel.range_max]
        calibration = {
            "formula": "value = scale * (factor * number + bias) + offset", "scale": channel.scale,
            "offset": channel.offset, "signal": channel.signal, "factor": float(signal.scale),
            "bias": float(signal.offset), "unit_of_dbc": signal.unit or "",
        }  # fmt: skip
        return Channel(
            name, channel.quantity, channel.unit, noise_std=channel.noise_std,
            quantum=None if signal.is_float else abs(channel.scale * float(signal.scale)), delay=self._options.delay,
            delay_std=self._options.delay_std, range_min=ends[0], range_max=ends[1],
            calibration=json.dumps(calibration), description=signal.comment or "",
        )  # fmt: skip
