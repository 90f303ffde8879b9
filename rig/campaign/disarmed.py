"""What a bench or campaign file switches off or widens until it no longer protects, and overrides.

Each is refused unless the same file has a line for it in its `[overrides]`, with a reason. Pure: opens nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import inf, isfinite
from pathlib import Path
from typing import NamedTuple

from drivers.protocols import Stream
from rig.campaign.config import BenchConfig, CampaignConfig, LimitConfig
from rig.errors import ConfigError

MOST_WATCHDOG_LIMIT = 2.0
"""s. VESC and Roboteq leave the factory with 1 s; one that nobody commands for longer runs."""
MOST_COAST_TIME = 30.0
"""s. Small thrusters in water rest within a few; what turns after that is driven."""
MOST_REST_RATE = 3.0
"""rev/s. What turns faster is no propeller at rest."""
MOST_MAX_AGE = 2.0
"""s, or 10 of the stream's own periods where that is longer."""
MOST_PERIODS = 10.0
MOST_OF_LIMIT = 0.05
"""Of the channel's own limit: thrust and current that may be left at rest where no rotation rate is measured. A
propeller that pushes more turns at more than a fifth of its fastest."""
NEEDED: Mapping[str, tuple[str, ...]] = {"thrust": ("min", "max"), "current": ("max",)}
"""Quantities whose limits stop the propeller before the bench breaks, and which ends are needed."""


class Disarmed(NamedTuple):
    """One protection that is not there. `key` is what `[overrides]` of that file calls it."""

    key: str
    cause: str
    """What is, and what would be right."""
    file: Path
    reason: str | None
    """Of the override; None: there is none, and the campaign is refused."""

    @property
    def told(self) -> str:
        """For who runs it: console, ledger and recording."""
        return f"{self.key}: {self.cause}; overridden: {self.reason}"


def disarmed(campaign: CampaignConfig, streams: Iterable[Stream]) -> tuple[Disarmed, ...]:
    """Every protection that the two files take away, with its override. ConfigError: an override of nothing."""
    bench = campaign.bench
    found = [
        *_of_file(bench.path, bench.overrides, _bench(bench, tuple(streams))),
        *_of_file(campaign.path, campaign.overrides, _campaign(campaign)),
    ]
    return tuple(found)


def require_armed(found: Iterable[Disarmed]) -> None:
    """Raises ConfigError for the first that nobody has owned up to."""
    for each in found:
        if each.reason is None:
            raise ConfigError(
                f"{each.file}: {each.key}: {each.cause}. If that is meant, say so in this file: "
                f'[overrides] "{each.key}" = "the reason"'
            )


def _of_file(path: Path, overrides: Mapping[str, str], found: Iterable[tuple[str, str]]) -> Iterator[Disarmed]:
    lacking = dict(found)
    for key in overrides:
        if key not in lacking:
            known = f"; what is: {', '.join(lacking)}" if lacking else ""
            raise ConfigError(f'{path}: overrides."{key}" overrides nothing: no such protection is taken away{known}')
    for key, cause in lacking.items():
        yield Disarmed(key, cause, path, overrides.get(key))


def _campaign(campaign: CampaignConfig) -> Iterator[tuple[str, str]]:
    if not campaign.prove_watchdog:
        yield "campaign.prove_watchdog", "the motor's own watchdog is not proved before the propeller is driven"


def _bench(bench: BenchConfig, streams: tuple[Stream, ...]) -> Iterator[tuple[str, str]]:
    for key, most, unit in (
        ("watchdog_limit", MOST_WATCHDOG_LIMIT, "s"),
        ("coast_time", MOST_COAST_TIME, "s"),
        ("rest_rate", MOST_REST_RATE, "rev/s"),
    ):
        value = getattr(bench, key)
        if value > most:
            yield f"bench.{key}", f"{value:g} {unit} protects nobody; at most {most:g} {unit} is expected"
    if not bench.consistency:
        yield "bench.consistency", "a thrust, rotation or current that contradicts the command passes; true is expected"
    channels = {f"{s.name}.{c.name}": (c.quantity, s.period_s) for s in streams for c in s.channels}
    limits = {limit.channel: limit for limit in bench.limits}
    yield from _rest(bench, limits, {name: quantity for name, (quantity, _) in channels.items()})
    for quantity, ends in NEEDED.items():
        yield from _unlimited([name for name, (q, _) in channels.items() if q == quantity], limits, ends)
    for name, limit in limits.items():
        yield from _widened(limit, *channels[name])


def _rest(
    bench: BenchConfig, limits: Mapping[str, LimitConfig], quantities: Mapping[str, str | None]
) -> Iterator[tuple[str, str]]:
    for key, quantity, unit in (("rest_thrust", "thrust", "N"), ("rest_current", "current", "A")):
        highest = [
            limit.max
            for name, limit in limits.items()
            if quantities.get(name) == quantity and limit.max is not None and isfinite(limit.max)
        ]
        value, most = getattr(bench, key), MOST_OF_LIMIT * min(highest, default=inf)
        if value is not None and value > most:
            yield (
                f"bench.{key}",
                f"{value:g} {unit} protects nobody; at most {most:g} {unit}, {MOST_OF_LIMIT:.0%} of the limit of the "
                f"{quantity}, is expected",
            )


def _unlimited(names: list[str], limits: Mapping[str, LimitConfig], ends: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """One channel of a quantity is enough; a quantity that is not measured has no limit to be set."""
    for end in ends if names else ():
        given = (getattr(limits.get(name), end, None) for name in names)
        if not any(value is not None and isfinite(value) for value in given):
            yield f"limits.{names[0]}.{end}", "nothing stops the propeller however large the value is: set it"


def _widened(limit: LimitConfig, quantity: str | None, period: float) -> Iterator[tuple[str, str]]:
    most = max(MOST_MAX_AGE, MOST_PERIODS * period)
    if limit.max_age is not None and limit.max_age > most:
        yield (
            f"limits.{limit.channel}.max_age",
            f"{limit.max_age:g} s of silence pass unseen; expected at most {most:g} s",
        )
    if limit.max_frozen == inf and quantity == "thrust":
        yield f"limits.{limit.channel}.max_frozen", "a frozen value passes for ever"
