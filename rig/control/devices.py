"""What is known of every device of the bench, for front ends. Asks no device: what it has said is looked up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from math import inf

from drivers import KINDS
from drivers.protocols import LinkHealth, Stream
from rig.campaign.bench import Bench
from rig.campaign.config import DeviceConfig
from rig.control.readings import Readings
from rig.link.front_end_messages import Device, StreamHealth

REFRESH = 0.5
"""s between two looks: they travel with each snapshot, which comes ten times a second."""
CLOSED = LinkHealth(alive=True, received=0, bad=0, first_bad=())
"""Of a device that is not open: its row of the preflight says why."""


@dataclass
class Devices:
    """Of one bench, looked at twice a second."""

    bench: Bench
    readings: Readings
    _seen: tuple[Device, ...] = ()
    _due: float = -inf

    def view(self, now: float, today: Callable[[], date], watchdog_measured: float | None) -> tuple[Device, ...]:
        """All devices, `REFRESH` s old at most; `now` in s, `watchdog_measured` in s from silence to rest."""
        if now >= self._due:
            self._due = now + REFRESH
            day = today() if self.bench.config.calibration else date.min
            self._seen = tuple(self._device(name, now, day, watchdog_measured) for name in self.bench.instruments)
        return self._seen

    def _device(self, name: str, now: float, day: date, measured: float | None) -> Device:
        config, instrument = self.bench.config, self.bench.instruments[name]
        identity, motor = self.bench.identities.get(name, ""), name == config.motor
        health = instrument.health() if identity else CLOSED
        calibration = config.calibration.get(name)
        until = calibration.valid_until if calibration else None
        return Device(
            name=name,
            kind=config.devices[name].kind,
            port=self._port(config.devices[name]),
            identity=identity,
            fault="" if health.alive else health.error or "its link is gone",
            streams=tuple(self._stream(stream, now) for stream in instrument.streams),
            received=health.received,
            bad=health.bad,
            first_bad=health.first_bad[0] if health.first_bad else "",
            dropped=health.dropped,
            calibrated=str(calibration.date) if calibration else "",
            valid_until=str(until) if until else "",
            days_left=calibration.days_left(day) if calibration else None,
            certificate=calibration.certificate if calibration else "",
            watchdog=self._watchdog() if motor else "",
            watchdog_measured=measured if motor else None,
        )

    def _port(self, device: DeviceConfig) -> str:
        """The serial port, or the bus and the port of its adapter."""
        if KINDS[device.kind].link == "can":
            bus = device.options.bus
            return f"{bus} ({self.bench.config.can[bus].channel})"
        return str(getattr(device.options, "port", ""))

    def _stream(self, stream: Stream, now: float) -> StreamHealth:
        latest = self.readings.latest.get(stream.name)
        age = None if latest is None else max(now - latest.t_ns * 1e-9, 0.0)
        return StreamHealth(stream.name, 1.0 / stream.period_s, self.readings.rate(stream.name), age)

    def _watchdog(self) -> str:
        """As the preflight tells it."""
        watchdog = self.bench.motor.watchdog
        if watchdog.timeout_s is None:
            return "off or unknown"
        return f"{watchdog.timeout_s:g} s, then {watchdog.action}; fed by {watchdog.fed_by}"
