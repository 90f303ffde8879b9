"""Bench and campaign files: TOML into the dataclasses of `config`. Opens no port; every fault is one sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

from drivers import KINDS
from rig.campaign.bench import build
from rig.campaign.calibration_file import read_cell
from rig.campaign.config import (
    BenchConfig,
    CalibrationConfig,
    CampaignConfig,
    CanBusConfig,
    DeviceConfig,
    LimitConfig,
    MountConfig,
    WatchConfig,
    twin_path,
)
from rig.campaign.dwell import Dwell, FixedDwell, SteadyDwell
from rig.campaign.limits import guarded_channels
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.shapes import SHAPES, Shape
from rig.campaign.waits import CoolDown
from rig.errors import ConfigError
from rig.names import require_name
from rig.toml_tables import Table, construct, decode, joined, parsed, read_toml, refuse_unknown, table_at, typed, values

T = TypeVar("T")

BENCH_ELSEWHERE = ("path", "text", "devices", "can", "limits", "mount", "calibration", "curves", "overrides")
"""Fields of BenchConfig that are no keys of `[bench]`."""
CAMPAIGN_ELSEWHERE = ("path", "text", "bench", "plan", "tare", "watch", "overrides")
"""Fields of CampaignConfig that are no keys of `[campaign]`."""
PLAN_ELSEWHERE = ("shape", "dwell", "coast_time", "tare", "cool_down")
"""Fields of Plan that are no keys of `[plan]`; the keys of its shape are."""
DWELLS: Mapping[str, type[Dwell]] = {"fixed": FixedDwell, "steady": SteadyDwell}


def load_bench(path: Path) -> BenchConfig:
    """Read a bench file. Raises ConfigError."""
    text, content = read_toml(path, "bench file")
    refuse_unknown(path, "", content, ("bench", "can", "devices", "limits", "mount", "calibration", "overrides"))
    scalars = values(BenchConfig, table_at(path, content, "bench"), path, "bench", elsewhere=BENCH_ELSEWHERE)
    buses = table_at(path, content, "can", optional=True)
    limits = table_at(path, content, "limits", optional=True)
    devices = table_at(path, content, "devices")
    calibration = _calibrations(path, table_at(path, content, "calibration", optional=True))
    bench = BenchConfig(
        path=path,
        text=text,
        can={name: _bus(path, name, table_at(path, buses, name, "can")) for name in buses},
        devices={name: _device(path, name, table_at(path, devices, name, "devices")) for name in devices},
        limits=tuple(_limit(path, channel, table_at(path, limits, channel, "limits")) for channel in limits),
        mount=decode(MountConfig, table_at(path, content, "mount", optional=True), path, "mount"),
        calibration=calibration,
        curves={name: read_cell(path.parent / each.file, name) for name, each in calibration.items() if each.file},
        overrides=_overrides(path, content),
        **scalars,
    )
    _require_bench_names(bench)
    _require_numbers(bench)
    _require_devices(bench)
    return bench


def load_campaign(path: Path) -> CampaignConfig:
    """Read a campaign file and the bench file it names. Raises ConfigError, or PlanError for an impossible plan."""
    text, content = read_toml(path, "campaign file")
    return _campaign(path, text, content)


def campaign_of(path: Path, text: str) -> CampaignConfig:
    """The campaign that `path` would be with `text` in it; the bench file is read. Raises as `load_campaign`."""
    return _campaign(path, text, parsed(text.replace("\r\n", "\n"), path))


def _campaign(path: Path, text: str, content: Table) -> CampaignConfig:
    refuse_unknown(path, "", content, ("campaign", "tare", "plan", "watch", "overrides"))
    table = table_at(path, content, "campaign")
    scalars = values(CampaignConfig, table, path, "campaign", elsewhere=CAMPAIGN_ELSEWHERE, also=("bench",))
    bench = load_bench((path.parent / _required(str, table, "bench", path, "campaign")).resolve())
    tare = decode(TareConfig, table_at(path, content, "tare", optional=True), path, "tare")
    plan = _plan(path, table_at(path, content, "plan"), tare, bench.coast_time)
    watch = _watch(path, table_at(path, content, "watch", optional=True))
    scalars |= {"plan": plan, "tare": tare, "watch": watch, "overrides": _overrides(path, content)}
    campaign = CampaignConfig(path=path, text=text, bench=bench, **scalars)
    if not campaign.thrusters or len(set(campaign.thrusters)) != len(campaign.thrusters):
        raise ConfigError(f"{path}: campaign.thrusters must name at least one thruster, and none twice")
    require_name(path, "campaign.name", campaign.name)
    for thruster in campaign.thrusters:
        require_name(path, "campaign.thrusters", thruster)
    _require_twins(campaign)
    _require_thermometer(campaign)
    if campaign.expected_C is not None:
        _require_above_zero(path, "campaign.expected_C", campaign.expected_C, "N/V^2")
    if campaign.flow_speed is not None and not math.isfinite(campaign.flow_speed):
        raise ConfigError(f"{path}: campaign.flow_speed must be a finite number of m/s, but is {campaign.flow_speed:g}")
    return replace(campaign, output=(path.parent / campaign.output).resolve())


def _required(kind: type[T], table: Table, key: str, path: Path, prefix: str) -> T:
    if key not in table:
        raise ConfigError(f"{path}: missing key {joined(prefix, key)}")
    found: T = typed(kind, table[key], path, joined(prefix, key))
    return found


def _choice(choices: Mapping[str, T], table: Table, path: Path, prefix: str) -> tuple[str, T, dict[str, Any]]:
    """The `kind` of a table, what it stands for, and the rest of the table."""
    kind = _required(str, table, "kind", path, prefix)
    if kind not in choices:
        known = ", ".join(sorted(choices))
        raise ConfigError(f"{path}: {joined(prefix, 'kind')} is {kind!r}, but must be one of {known}")
    return kind, choices[kind], {key: value for key, value in table.items() if key != "kind"}


def _plan(path: Path, table: Table, tare: TareConfig, coast_time: float) -> Plan:
    _, shape, rest = _choice(SHAPES, table, path, "plan")
    own = [field.name for field in fields(shape)]
    pacing = values(Plan, rest, path, "plan", elsewhere=PLAN_ELSEWHERE, also=(*own, "dwell", "cool_down"))
    made: Shape = decode(shape, {key: value for key, value in rest.items() if key in own}, path, "plan")
    # a sweep or a sine has no holds; the dwell it is given is never used
    held = "dwell" in table or shape not in (SHAPES["ramp"], SHAPES["sine"])
    dwell = _dwell(path, table_at(path, table, "dwell", "plan")) if held else FixedDwell(1.0)
    parts = {"shape": made, "dwell": dwell, "tare": tare, "coast_time": coast_time}
    if "cool_down" in table:
        pacing["cool_down"] = decode(CoolDown, table_at(path, table, "cool_down", "plan"), path, "plan.cool_down")
    return construct(Plan, parts | pacing, path, "plan")


def _overrides(path: Path, content: Table) -> dict[str, str]:
    table = table_at(path, content, "overrides", optional=True)
    for key, reason in table.items():
        if not isinstance(reason, str) or not reason.strip():
            raise ConfigError(f"{path}: {joined('overrides', key)} must be a text that says why, but is {reason!r}")
    return table


def _watch(path: Path, table: Table) -> WatchConfig:
    watch = decode(WatchConfig, table, path, "watch")
    _require_above_zero(path, "watch.false_alarms_per_hour", watch.false_alarms_per_hour, "alarms per hour")
    return replace(watch, twin=str(path.parent.resolve() / watch.twin)) if watch.twin else watch


def _require_twins(campaign: CampaignConfig) -> None:
    """The twins that the runs are watched with are there."""
    for thruster in campaign.thrusters:
        twin = twin_path(campaign.watch.twin, thruster)
        if campaign.watch.twin and not Path(twin).is_file():
            raise ConfigError(
                f"{campaign.path}: watch.twin of {thruster} is {twin}, but there is no such file; "
                "`rig diagnose --save-twin` writes one"
            )


def _require_thermometer(campaign: CampaignConfig) -> None:
    """The channel that a cool-down waits for is there, and its freshness is judged as the guard does."""
    cool = campaign.plan.cool_down
    if cool is None:
        return
    limited = {limit.channel for limit in campaign.bench.limits}
    known = [
        name
        for _, stream in build(campaign.bench).streams()
        for channel in stream.channels
        if channel.unit == "degC" and ((name := f"{stream.name}.{channel.name}") in limited or channel.quantity)
    ]
    if cool.channel not in known:
        raise ConfigError(
            f"{campaign.path}: plan.cool_down.channel is {cool.channel!r}, but must be a channel in degC that has a "
            f"quantity or a limit; this bench has {', '.join(known) or 'none'}"
        )


def _dwell(path: Path, table: Table) -> Dwell:
    _, dwell, rest = _choice(DWELLS, table, path, "plan.dwell")
    return decode(dwell, rest, path, "plan.dwell")


def _bus(path: Path, name: str, table: Table) -> CanBusConfig:
    bus = decode(CanBusConfig, table, path, joined("can", name))
    return replace(bus, channel=_resolved(bus.channel, path))


def _device(path: Path, name: str, table: Table) -> DeviceConfig:
    prefix = joined("devices", name)
    kind, found, rest = _choice(KINDS, table, path, prefix)
    if isinstance(rest.get("port"), str):
        rest["port"] = _resolved(rest["port"], path)
    if isinstance(rest.get("map"), str) and rest["map"].endswith(".toml"):
        rest["map"] = str((path.parent / rest["map"]).resolve())
    return DeviceConfig(name, kind, decode(found.options, rest, path, prefix))


def _calibrations(path: Path, tables: Table) -> dict[str, CalibrationConfig]:
    at = "calibration"
    return {
        name: decode(CalibrationConfig, table_at(path, tables, name, at), path, joined(at, name)) for name in tables
    }


def _limit(path: Path, channel: str, table: Table) -> LimitConfig:
    prefix = joined("limits", channel)
    limit = construct(
        LimitConfig,
        {"channel": channel} | values(LimitConfig, table, path, prefix, elsewhere=("channel",)),
        path,
        prefix,
    )
    for key, value in (("min", limit.min), ("max", limit.max)):
        if value is not None and math.isnan(value):
            raise ConfigError(f"{path}: {prefix}.{key} must be a number, but is nan")
    if limit.min is not None and limit.max is not None and limit.min >= limit.max:
        raise ConfigError(f"{path}: {prefix}.min ({limit.min:g}) must be below max ({limit.max:g})")
    if limit.max_age is not None:
        _require_above_zero(path, f"{prefix}.max_age", limit.max_age, "s")
    if limit.max_frozen is not None and not limit.max_frozen > 0:
        raise ConfigError(
            f"{path}: {prefix}.max_frozen must be above 0 s (inf: not judged), but is {limit.max_frozen:g}"
        )
    return limit


def _resolved(port: str, path: Path) -> str:
    """A relative port with a slash is relative to the file that names it; URLs and plain names stay."""
    if "://" in port or "/" not in port or Path(port).is_absolute():
        return port
    return str(path.parent / port)


def _require_above_zero(path: Path, key: str, value: float, unit: str) -> None:
    if not 0 < value < math.inf:
        raise ConfigError(f"{path}: {key} must be above 0 {unit}, but is {value:g}")


def _require_bench_names(bench: BenchConfig) -> None:
    require_name(bench.path, "bench.name", bench.name)
    for table, names in (("devices", bench.devices), ("can", bench.can)):
        for name in names:
            require_name(bench.path, f"the name of a table of [{table}]", name)


def _require_numbers(bench: BenchConfig) -> None:
    for key, unit in (
        ("max_voltage", "V"),
        ("slew", "V/s"),
        ("loop_rate", "Hz"),
        ("watchdog_limit", "s"),
        ("rest_rate", "rev/s"),
        ("coast_time", "s"),
        ("proof_voltage", "V"),
    ):
        _require_above_zero(bench.path, f"bench.{key}", getattr(bench, key), unit)
    for key, unit in (("water_density", "kg/m^3"), ("rest_thrust", "N"), ("rest_current", "A")):
        if (value := getattr(bench, key)) is not None:
            _require_above_zero(bench.path, f"bench.{key}", value, unit)
    if bench.proof_voltage > bench.max_voltage:
        raise ConfigError(
            f"{bench.path}: bench.proof_voltage ({bench.proof_voltage:g} V) must not exceed "
            f"bench.max_voltage ({bench.max_voltage:g} V)"
        )


def _require_devices(bench: BenchConfig) -> None:
    """Names that point at each other must exist; a limit needs a channel. Builds the devices, which opens nothing."""
    path, devices = bench.path, ", ".join(bench.devices) or "none"
    for role in ("motor", "force"):
        name = getattr(bench, role)
        if name not in bench.devices:
            raise ConfigError(
                f"{path}: bench.{role} names {name!r}, but there is no [devices.{name}]; there are {devices}"
            )
    for name, device in bench.devices.items():
        if KINDS[device.kind].link == "can" and device.options.bus not in bench.can:
            raise ConfigError(
                f"{path}: devices.{name}.bus names {device.options.bus!r}, but there is no [can.{device.options.bus}]"
            )
    for name in bench.calibration:
        if name not in bench.devices:
            raise ConfigError(f"{path}: [calibration.{name}] is of no device of this bench; there are {devices}")
        if bench.calibration[name].file and name == bench.motor:
            raise ConfigError(f"{path}: calibration.{name}.file: dead weights calibrate a load cell, not the motor")
    built = build(bench)
    assert built.motor  # raises ConfigError when it can't turn a propeller
    streams = [stream for _, stream in built.streams()]
    force = [channel for stream in built.instruments[bench.force].streams for channel in stream.channels]
    if all(channel.quantity != "thrust" for channel in force):
        raise ConfigError(f"{path}: bench.force names {bench.force!r}, which measures no thrust; name a force sensor")
    try:
        guarded_channels(bench.limits, streams)
    except ValueError as error:
        raise ConfigError(f"{path}: [limits]: {error}") from None
