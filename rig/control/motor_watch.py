"""The motor's own word, judged against the command and against itself: fed every tick, asked when it matters."""

from __future__ import annotations

from typing import NamedTuple

from drivers.protocols import Sample
from rig.campaign.bench import Bench
from rig.control.consistency_watch import ConsistencyWatch
from rig.safety.following import Following
from rig.safety.frozen_motor import FrozenMotor, MotorRows
from rig.safety.guard import Trip


def rotation_channel(bench: Bench) -> str | None:
    """The motor's own rotation rate if it has one, else the first on the bench."""
    names = [
        (device != bench.config.motor, f"{stream.name}.{channel.name}")
        for device, stream in bench.streams()
        for channel in stream.channels
        if channel.quantity == "rotation_rate"
    ]
    return min(names)[1] if names else None


class RestByThrust(NamedTuple):
    """How rest is told on a bench that measures no rotation rate (decision 22)."""

    thrust: float
    """N from the tare that are no push."""
    channel: str
    """Of the current."""
    current: float
    """A that drive nothing."""


def rest_by_thrust(bench: Bench, rotation: str | None) -> RestByThrust | None:
    """None where the rotation rate is measured, the bench file does not give both limits, or there is no current."""
    config = bench.config
    if rotation is not None or config.rest_thrust is None or config.rest_current is None:
        return None
    names = [
        (device != config.motor, f"{stream.name}.{channel.name}")
        for device, stream in bench.streams()
        for channel in stream.channels
        if channel.quantity == "current"
    ]
    return RestByThrust(config.rest_thrust, min(names)[1], config.rest_current) if names else None


class MotorWatch:
    """One bench's. Without a rotation rate rest is never confirmed."""

    def __init__(self, bench: Bench, thrust: str) -> None:
        """`thrust`: the channel of the force device, as `<stream>.<channel>`."""
        self.channel = rotation_channel(bench)
        """Of the rotation rate; None: not measured on this bench."""
        self._config = bench.config
        self._trip: Trip | None = None
        self._frozen = FrozenMotor(_rows(bench, self.channel)) if self.channel is not None else None
        self.consistency = ConsistencyWatch(bench, self.channel, thrust)
        self.begin_run()

    def begin_run(self) -> None:
        """Another thruster may be wired the other way round."""
        self._following = Following(self.channel or "", self._config.proof_voltage, self._config.rest_rate)
        self.consistency.begin_run()

    def advance(
        self, samples: tuple[Sample, ...], command: float | None, rate: float | None, now: float, *, in_run: bool
    ) -> None:
        """`command`: V sent in the last tick, None: nothing was; `rate`: rev/s, newest and fresh. Outside a run hands
        may turn the propeller: only the rows are looked at."""
        inconsistent = self.consistency.advance(samples, command, now) if in_run else None
        if self._frozen is None:
            self._trip = inconsistent
            return
        self._trip = self._frozen.advance(samples, command or 0.0, now)
        following = self._following.advance(now, command, rate) if in_run else None
        if following is not None:
            self._frozen.doubt(following)
            self._trip = self._trip or following
        self._trip = self._trip or inconsistent

    @property
    def trip(self) -> Trip | None:
        """Of the last tick."""
        return self._trip

    @property
    def believed(self) -> bool:
        """False from the moment the rotation rate was found frozen until its rows live again."""
        return self._frozen is not None and self._frozen.trip is None


def _rows(bench: Bench, channel: str) -> MotorRows:
    config = bench.config
    stream = next(s for _, s in bench.streams() for c in s.channels if f"{s.name}.{c.name}" == channel)
    names = [f"{stream.name}.{each.name}" for each in stream.channels]
    current = next((i for i, each in enumerate(stream.channels) if each.quantity == "current"), None)
    limits = [limit.max for limit in config.limits if current is not None and limit.channel == names[current]]
    return MotorRows(
        stream.name,
        stream.period_s,
        names.index(channel),
        current,
        limits[0] if limits else None,
        config.rest_rate,
        config.max_voltage,
    )
