"""The list that must be green before a propeller may turn. Pure: judges what was read, opens nothing."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from datetime import date
from statistics import fmean
from typing import Literal

from drivers.protocols import Stream, Watchdog
from rig.campaign.config import BenchConfig, CalibrationConfig
from rig.campaign.disarmed import Disarmed
from rig.control.consistency_watch import ConsistencyWatch
from rig.control.readings import Readings
from rig.link.front_end_messages import Check, Reading
from rig.safety.pace import FASTEST, SLOWEST

Verdict = Literal["waiting", "passed", "warning", "failed"]

RATE_TOLERANCE = 0.25
"""Relative difference between a stream's real and nominal rate that is still taken as healthy."""
OLD, OLD_PERIODS = 1.0, 5
"""s and sample periods, whichever is longer, since the last row of a stream that still counts as coming."""
FLOW_TOLERANCE = 0.1
"""Of the speed that the campaign is meant for: measured flow that is farther off is told, from FLOW_TOO_FAR times that
on the campaign is not begun."""
LEAST_FLOW_TOLERANCE = 0.05
"""m/s"""
FLOW_TOO_FAR = 2.5


def device_checks(identities: Mapping[str, str], failures: Mapping[str, str], names: Iterable[str]) -> list[Check]:
    """One line per device: who it says it is, or why it did not open."""
    checks = []
    for name in names:
        if name in failures:
            checks.append(Check(name, "failed", failures[name]))
        elif name in identities:
            checks.append(Check(name, "passed", identities[name]))
        else:
            checks.append(Check(name, "waiting", "opening"))
    return checks


def rate_check(stream: Stream, rate: float | None, age: float = 0.0) -> Check:
    """Does the stream come as fast as it should? `age`: s since its last row."""
    nominal = 1.0 / stream.period_s
    name = f"{stream.name} rate"
    if rate is None:
        return Check(name, "failed", f"no samples came; {nominal:.3g}/s are expected")
    if age > max(OLD, OLD_PERIODS * stream.period_s):
        return Check(name, "failed", f"nothing came for {age:.1f} s; {nominal:.3g}/s are expected")
    if not SLOWEST <= rate / nominal <= FASTEST:
        text = f"{rate:.3g}/s of {nominal:.3g}/s: a run would be stopped for it; correct the device or the bench file"
        return Check(name, "failed", text)
    verdict: Verdict = "passed" if abs(rate / nominal - 1.0) <= RATE_TOLERANCE else "warning"
    return Check(name, verdict, f"{rate:.3g}/s of {nominal:.3g}/s")


def watchdog_check(watchdog: Watchdog, limit: float, *, proving: bool) -> Check:
    """The motor controller must stop by itself when we fall silent (docs/reliability.md, rules 1 and 2, promise 9).

    `proving`: whether that is measured before the campaign; else it is only what the device or the bench file says.
    """
    if watchdog.timeout_s is None:
        return Check("watchdog", "failed", "the motor controller's own command timeout is off or unknown: refused")
    text = f"{watchdog.timeout_s:g} s, then {watchdog.action}; fed by {watchdog.fed_by}"
    if watchdog.timeout_s > limit:
        return Check("watchdog", "failed", f"{text}; longer than this bench's limit of {limit:g} s: refused")
    if not proving:
        return Check("watchdog", "warning", f"{text}; declared, not proved: the campaign says prove_watchdog = false")
    return Check("watchdog", "passed", text)


def rest_check(readings: Collection[Reading], config: BenchConfig) -> Check:
    """The propeller must be at rest, measured, before it is armed."""
    rest_rate = config.rest_rate
    rates = [r for r in readings if r.quantity == "rotation_rate"]
    if not rates:
        return _rest_without_a_rate([r for r in readings if r.quantity == "current"], config)
    moving = [r for r in rates if r.value is None or abs(r.value) > rest_rate]
    if moving:
        value = "unknown" if moving[0].value is None else f"{moving[0].value:.1f} rev/s"
        return Check("at rest", "failed", f"{moving[0].channel} is {value}; wait until |rate| < {rest_rate:g} rev/s")
    return Check("at rest", "passed", f"|rotation rate| < {rest_rate:g} rev/s")


def _rest_without_a_rate(currents: Collection[Reading], config: BenchConfig) -> Check:
    """The thrust has no tare yet: what the current says now, and on what rest will be told in the run."""
    without = "no rotation rate is measured on this bench"
    if config.rest_thrust is None or config.rest_current is None or not currents:
        lacking = "" if currents else "no current is measured either; "
        return Check(
            "at rest",
            "warning",
            f"{without}: {lacking}rest can't be confirmed, unless bench.rest_thrust and bench.rest_current say when "
            "thrust and current stand for it",
        )
    driving = [r for r in currents if r.value is None or abs(r.value) > config.rest_current]
    if driving:
        value = "unknown" if driving[0].value is None else f"{driving[0].value:.2f} A"
        text = f"{driving[0].channel} is {value}; wait until it is at most {config.rest_current:g} A"
        return Check("at rest", "failed", text)
    return Check(
        "at rest",
        "warning",
        f"{without}: at rest means {config.coast_time:g} s at 0 V, then thrust within {config.rest_thrust:g} N of its "
        f"tare and current at most {config.rest_current:g} A; a propeller that turns too slowly to push is not seen",
    )


def stop_input_check(readings: Iterable[Reading]) -> Check | None:
    """A pressed emergency stop refuses; a bench without one is told so nowhere else."""
    inputs = [r for r in readings if r.quantity == "emergency_stop"]
    if not inputs:
        return Check(
            "emergency stop", "warning", "this bench has no emergency stop input: the rig can't see one pressed"
        )
    if any(r.value != 0 for r in inputs):
        return Check("emergency stop", "failed", "pressed or unknown; release it")
    return Check("emergency stop", "passed", "released")


def flow_check(wanted: float, measured: Collection[float], *, patient: bool = False) -> Check | None:
    """Does the water move as the campaign is meant for? `measured`: m/s, of the last seconds; none: no flow meter.

    `patient`: it may be on its way there.
    """
    asked = f"the campaign is meant for {wanted:g} m/s"
    if not measured:
        return Check("flow", "warning", f"{asked}, which is not measured") if wanted else None
    mean = fmean(measured)
    apart = abs(mean - wanted) / max(FLOW_TOLERANCE * abs(wanted), LEAST_FLOW_TOLERANCE)
    text = f"{mean:.3g} m/s measured; {asked}"
    if apart > FLOW_TOO_FAR:
        verdict: Verdict = "waiting" if patient else "failed"
        return Check("flow", verdict, f"{text}: set the water, or correct campaign.flow_speed")
    return Check("flow", "warning" if apart > 1.0 else "passed", text)


def limit_checks(readings: Iterable[Reading]) -> list[Check]:
    """Channels with a limit must be fresh and inside it."""
    checks = []
    for r in readings:
        if r.low is None and r.high is None:
            continue
        value = "nothing came" if r.value is None else f"{r.value:.4g} {r.unit}"
        verdict: Verdict = "passed" if r.state == "ok" else "failed"
        checks.append(Check(r.channel, verdict, f"{value}, {_allowed(r)}: {r.state}"))
    return checks


def _allowed(r: Reading) -> str:
    if r.low is None:
        return f"at most {r.high:g} {r.unit} allowed"
    if r.high is None:
        return f"at least {r.low:g} {r.unit} allowed"
    return f"{r.low:g} to {r.high:g} {r.unit} allowed"


def armed_checks(found: Iterable[Disarmed]) -> list[Check]:
    """Protections that the files take away: owned up to, or a failure."""
    return [
        Check("override", "failed", f"{each.key}: {each.cause}; no override owns up to it")
        if each.reason is None
        else Check("override", "warning", each.told)
        for each in found
    ]


def calibration_checks(calibrations: Mapping[str, CalibrationConfig], today: date) -> list[Check]:
    """One line for each device whose calibration the bench file dates. One that is over warns: what is measured can be
    corrected later."""
    checks = []
    for device, calibration in calibrations.items():
        left, text = calibration.days_left(today), f"of {calibration.date}"
        text += "" if calibration.valid_until is None else f", valid until {calibration.valid_until}"
        over = left is not None and left < 0
        verdict: Verdict = "warning" if over or calibration.date > today else "passed"
        text += ": over" if over else ": a day to come" if calibration.date > today else ""
        checks.append(Check(f"{device} calibration", verdict, text))
    return checks


def consistency_check(watch: ConsistencyWatch) -> Check:
    """On what the check of command against rotation, current and thrust rests; a bench may lack one of them."""
    return Check("consistency", "warning" if watch.lacking else "passed", watch.rests_on)


def all_checks(
    config: BenchConfig,
    readings: Readings,
    watchdog: Watchdog,
    now: float,
    *,
    proving: bool,
    without: Collection[str] = (),
) -> list[Check]:
    """Everything that is judged once the devices are open; nothing of the streams of those that are not."""
    view = [reading for reading in readings.view(now) if readings.place[reading.channel][0] not in without]
    there = [stream for name, stream in readings.streams.items() if name not in without]
    checks = [rate_check(stream, readings.rate(stream.name), readings.age(stream.name, now)) for stream in there]
    checks.append(watchdog_check(watchdog, config.watchdog_limit, proving=proving))
    checks.append(rest_check(view, config))
    stop_input = stop_input_check(view)
    if stop_input is not None:
        checks.append(stop_input)
    checks += limit_checks(view)
    return checks
