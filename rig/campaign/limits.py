"""Which channels the guard judges, and by what: configured limits resolved against the streams of the bench. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from drivers.protocols import Stream
from rig.campaign.config import LimitConfig

MIN_AGE = 0.2
"""s, shortest default sample age (docs/reliability.md, promise 7: within max(3 sample periods, 0.2 s))."""


@dataclass(frozen=True, slots=True)
class GuardedChannel:
    """One channel under guard, defaults resolved. Values in the channel's unit, `max_age` in s."""

    channel: str
    unit: str
    max_age: float
    min: float | None = None
    max: float | None = None
    max_frozen: float | None = None
    """s; None: not judged. 0: by its earlier variation (`frozen_limit`)."""
    stops: bool = False
    """An emergency stop input: anything but 0 is pressed."""


def guarded_channels(
    limits: Iterable[LimitConfig], streams: Iterable[Stream], essential: Iterable[str] = (), thrust: str = ""
) -> tuple[GuardedChannel, ...]:
    """Resolve configured limits against the bench's streams; `essential` channels are watched for age and NaN anyway.
    The `thrust` channel is watched for a frozen value as well, by its own earlier variation if nothing is configured;
    an emergency stop input always, whatever is configured.

    Channels are `<stream>.<channel>`. Raises ValueError naming a channel that no stream has.
    """
    channels = {f"{s.name}.{c.name}": (s, c) for s in streams for c in s.channels}
    known = {name: (c.unit, max(3 * s.period_s, MIN_AGE)) for name, (s, c) in channels.items()}
    stops = [name for name, (_, c) in channels.items() if c.quantity == "emergency_stop"]
    wanted = {limit.channel: limit for limit in limits}
    wanted = {channel: wanted.get(channel, LimitConfig(channel)) for channel in (*wanted, *essential, *stops)}
    for channel in wanted:
        if channel not in known:
            raise ValueError(f"no device gives a channel {channel}; there are {', '.join(sorted(known))}")
    learned = {thrust: 0.0}
    return tuple(
        GuardedChannel(
            channel,
            known[channel][0],
            known[channel][1] if c.max_age is None else c.max_age,
            c.min,
            c.max,
            learned.get(channel) if c.max_frozen is None else c.max_frozen,
            channel in stops,
        )
        for channel, c in wanted.items()
    )
