"""The configured devices as live objects: built without opening anything, opened one by one, closed in reverse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf

from drivers import KINDS
from drivers.errors import DeviceError as DriverDeviceError
from drivers.errors import LinkError as DriverLinkError
from drivers.extras import MissingExtra
from drivers.ports.can_bus import CanBus
from drivers.ports.wire import Wire
from drivers.protocols import Coarse, Instrument, MotorController, Paced, Sample, Stream
from rig.campaign.calibrated import Calibrated
from rig.campaign.config import BenchConfig, CanBusConfig
from rig.errors import ConfigError, DeviceError, LinkError

COMMAND_STREAM = "command"
"""The rig's own stream: one row per change of the commanded voltage."""


@dataclass(frozen=True)
class Bench:
    """All devices of a bench. `identities` fills while they open."""

    config: BenchConfig
    buses: Mapping[str, CanBus]
    instruments: Mapping[str, Instrument]
    identities: dict[str, str] = field(default_factory=dict)

    @property
    def motor(self) -> MotorController:
        motor = self.instruments[self.config.motor]
        if not isinstance(motor, MotorController):
            raise ConfigError(
                f"{self.config.path}: bench.motor is {self.config.motor!r}, which measures but can't turn a propeller:"
                " name a motor controller"
            )
        return motor

    def told(self, volts: float) -> float:
        """V of the set-point that the motor controller gets for a command of `volts`."""
        motor = self.instruments[self.config.motor]
        return motor.told(volts) if isinstance(motor, Coarse) else volts

    def holds(self, volts: float) -> float:
        """V of the set-point that the motor controller has, now that it was given a command of `volts`."""
        motor = self.instruments[self.config.motor]
        return motor.holds if isinstance(motor, Paced) else self.told(volts)

    def streams(self) -> Iterator[tuple[str, Stream]]:
        """(device name, stream) of every device, in the order of the bench file."""
        for name, instrument in self.instruments.items():
            for stream in instrument.streams:
                yield name, stream

    def open_device(self, name: str) -> str:
        """Open one device (and its bus, if it is the first on it); returns its identity."""
        instrument = self.instruments[name]
        try:
            if KINDS[self.config.devices[name].kind].link == "can":
                self.buses[self.config.devices[name].options.bus].open()
            identity = instrument.open()
        except DriverLinkError as error:
            raise LinkError(_about(name, error)) from error
        except DriverDeviceError as error:
            raise DeviceError(_about(name, error)) from error
        self.identities[name] = identity
        return identity

    def drain(self) -> list[Sample]:
        return [sample for instrument in self.instruments.values() for sample in instrument.drain()]

    def close(self) -> None:
        for instrument in reversed(list(self.instruments.values())):
            instrument.close()
        for bus in self.buses.values():
            bus.close()


def build(config: BenchConfig, wires: Mapping[str, Wire] | None = None) -> Bench:
    """Construct the devices of a bench file; opens nothing. Raises ConfigError.

    `wires`: instead of all the ports of the file, by the name of the device or of the bus.
    """
    buses = {name: _bus(name, bus, config, wires) for name, bus in config.can.items()}
    instruments: dict[str, Instrument] = {}
    for name, device in config.devices.items():
        kind = KINDS[device.kind]
        over: tuple[object, ...] = ()
        if kind.link == "can":
            over = (buses[device.options.bus],)
        elif wires is not None:
            over = (_wire(name, config, wires),)
        try:
            instruments[name] = kind.build(name, device.options, *over)
        except MissingExtra as error:
            raise ConfigError(f"{config.path}: devices.{name}: {error}") from error
        if name in config.curves:
            instruments[name] = _calibrated(instruments[name], config)
    return Bench(config, buses, instruments)


def _calibrated(instrument: Instrument, config: BenchConfig) -> Instrument:
    of = config.calibration[instrument.name]
    try:
        return Calibrated(instrument, config.curves[instrument.name], str(of.date), of.certificate)
    except ValueError as error:
        raise ConfigError(f"{config.path}: calibration.{instrument.name}.file: {error}") from None


def thrust_bounds(config: BenchConfig) -> tuple[float, float]:
    """N, lowest and highest thrust within the range of the force sensor and the limits of the bench file; infinite
    where neither says."""
    bounds = [(-inf, inf)]
    for stream in build(config).instruments[config.force].streams:
        for channel in (c for c in stream.channels if c.quantity == "thrust"):
            bounds.append((_or(channel.range_min, -inf), _or(channel.range_max, inf)))
            name = f"{stream.name}.{channel.name}"
            bounds += [(_or(m.min, -inf), _or(m.max, inf)) for m in config.limits if m.channel == name]
    return max(low for low, _ in bounds), min(high for _, high in bounds)


def _or(end: float | None, otherwise: float) -> float:
    return otherwise if end is None else end


def _wire(name: str, config: BenchConfig, wires: Mapping[str, Wire]) -> Wire:
    if name not in wires:
        raise ConfigError(f"{config.path}: {name} has no wire on this bench; it has {', '.join(wires) or 'none'}")
    return wires[name]


def _bus(name: str, bus: CanBusConfig, config: BenchConfig, wires: Mapping[str, Wire] | None) -> CanBus:
    wire = None if wires is None else _wire(name, config, wires)
    try:
        return CanBus(bus.interface, bus.channel, bus.bitrate, bus.capture, wire)
    except ValueError as error:
        raise ConfigError(f"{config.path}: can.{name}: {error}") from None


def _about(name: str, error: Exception) -> str:
    """The driver's sentence, led by the device's name if it does not begin with it."""
    text = str(error)
    return text if text.startswith(f"{name}:") else f"{name}: {text}"
