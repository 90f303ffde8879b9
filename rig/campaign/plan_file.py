"""Levels become a campaign file that `rig check` accepts and `rig run` takes: voltages, seconds, and the flow."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import groupby
from math import isfinite
from pathlib import Path
from typing import Protocol

from rig.campaign.config import CampaignConfig, WatchConfig
from rig.campaign.plan import TareConfig
from rig.campaign.shapes import require, require_above_zero
from rig.campaign.waits import CoolDown
from rig.errors import ConfigError

WATER = ("settle_water", "settle_reversal")
"""Keys of waits for the water."""


class Held(Protocol):
    """A step as this module needs it; any object with these three will do."""

    @property
    def voltage(self) -> float:
        """V"""

    @property
    def duration(self) -> float:
        """s, settling included."""

    @property
    def flow_speed(self) -> float | None:
        """m/s that the water shall have; None: whatever it has."""


@dataclass(frozen=True, slots=True)
class Level:
    """A step held at `voltage` V for `duration` s, settling included."""

    voltage: float
    duration: float
    flow_speed: float | None = None


@dataclass(frozen=True, slots=True)
class Template:
    """Of a campaign file: all but its plan's shape. `tare` and `rest` are those of the zero returns."""

    name: str
    bench: Path
    thrusters: tuple[str, ...]
    output: Path
    slew: float
    """V/s"""
    tare: TareConfig
    settle: float = 0.5
    """s at the start of each hold that its mean leaves out."""
    zero_every: int = 4
    """Holds between zero returns; 0: none but the last."""
    rest: float = 1.0
    """s"""
    operator: str = ""
    notes: str = ""
    unattended: bool = False
    expected_C: float | None = None
    """N/V^2"""
    prove_watchdog: bool = True
    overrides: Mapping[str, str] = field(default_factory=dict)
    watch: WatchConfig = field(default_factory=WatchConfig)
    settle_water: float = 0.0
    """s"""
    settle_reversal: float = 0.0
    """s"""
    cool_down: CoolDown | None = None


def template_of(campaign: CampaignConfig) -> Template:
    """What a campaign has beside its shape."""
    plan = campaign.plan
    return Template(
        campaign.name,
        campaign.bench.path,
        campaign.thrusters,
        campaign.output,
        plan.slew,
        campaign.tare,
        plan.dwell.settle,
        plan.zero_every,
        plan.rest,
        campaign.operator,
        campaign.notes,
        campaign.unattended,
        campaign.expected_C,
        campaign.prove_watchdog,
        campaign.overrides,
        campaign.watch,
        plan.settle_water,
        plan.settle_reversal,
        plan.cool_down,
    )


def write_campaign(
    levels: Iterable[Held], template: Template, path: Path, comment: Sequence[str] = ()
) -> tuple[Path, ...]:
    """Write the levels in their order; returns the files, each read back with `load_campaign`.

    The rig does not set the flow, an operator does. So there is one file for each stretch of one flow speed: `path`
    when there is only one, else `path` with its number before the suffix. Raises PlanError for levels that are none,
    ConfigError when a file cannot be written.
    """
    wanted = tuple(levels)
    _require_levels(wanted)
    stretches = [(flow, tuple(part)) for flow, part in groupby(wanted, key=lambda level: level.flow_speed)]
    return tuple(
        _write(file, "\n".join([*_said(comment), *_head(template, file, flow), *_levels(part, template), ""]))
        for file, (flow, part) in zip(files_of(wanted, path), stretches, strict=True)
    )


def files_of(levels: Sequence[Held], path: Path) -> list[Path]:
    """That `write_campaign` writes."""
    count = sum(1 for _ in groupby(levels, key=lambda level: level.flow_speed))
    return [path] if count == 1 else [_numbered(path, k) for k in range(1, count + 1)]


def write_sine(
    amplitude: float,
    frequency: float,
    cycles: int,
    template: Template,
    path: Path,
    comment: Sequence[str] = (),
) -> Path:
    """Write `cycles` of a sine of `amplitude` V at `frequency` Hz about 0 V; read back as `write_campaign` does."""
    plan = ["[plan]", 'kind = "sine"', f"amplitude = {amplitude!r}                # V"]
    plan += [f"frequencies = [{frequency!r}]   # Hz", f"cycles = {cycles}", *_pacing(template)]
    return _write(path, "\n".join([*_said(comment), *_head(template, path, None), *plan, ""]))


def _require_levels(levels: Sequence[Held]) -> None:
    require(len(levels) > 0, "there are no levels to write: a plan without levels measures nothing")
    for level in levels:
        require(isfinite(level.voltage), f"a level must be a finite number in V, but one is {level.voltage:g}")
        require_above_zero(f"the duration of the level at {level.voltage:g} V", level.duration, "s")
        flow = level.flow_speed
        require(flow is None or isfinite(flow), f"a flow speed must be a finite number of m/s, but one is {flow}")


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}-{number}{path.suffix}")


def _said(comment: Sequence[str]) -> list[str]:
    return [f"# {line}".rstrip() for text in comment for line in text.splitlines()]


def _text(value: str) -> str:
    """A TOML string: JSON's escapes are TOML's, but for the delete character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _relative(target: Path, file: Path) -> str:
    return Path(os.path.relpath(target.resolve(), file.parent.resolve())).as_posix()


def _head(template: Template, file: Path, flow: float | None) -> list[str]:
    lines = ["[campaign]", f"name = {_text(template.name)}", f"bench = {_text(_relative(template.bench, file))}"]
    lines.append(f"thrusters = [{', '.join(_text(name) for name in template.thrusters)}]")
    lines.append(f"output = {_text(_relative(template.output, file))}")
    lines += [f"{key} = {_text(value)}" for key in ("operator", "notes") if (value := getattr(template, key))]
    lines += ["unattended = true"] if template.unattended else []
    lines += ["prove_watchdog = false"] if not template.prove_watchdog else []
    lines += [f"expected_C = {float(template.expected_C)!r}   # N/V^2"] if template.expected_C is not None else []
    lines += [f"flow_speed = {float(flow)!r}   # m/s, to be set by hand before the run"] if flow is not None else []
    tare = template.tare
    lines += ["", "[tare]", f"duration = {float(tare.duration)!r}   # s"]
    lines += [f"max_std_error = {float(tare.max_std_error)!r}   # N", f"max_drift = {float(tare.max_drift)!r}   # N/s"]
    return [*lines, f"attempts = {tare.attempts}", "", *_overrides(template.overrides), *_watch(template.watch, file)]


def _overrides(overrides: Mapping[str, str]) -> list[str]:
    lines = [f"{_text(key)} = {_text(reason)}" for key, reason in overrides.items()]
    return ["[overrides]", *lines, ""] if lines else []


def _watch(watch: WatchConfig, file: Path) -> list[str]:
    """`[watch]` with what is not the default; nothing when all is."""
    said = {f.name: value for f in fields(watch) if (value := getattr(watch, f.name)) != f.default}
    if watch.twin:
        said["twin"] = _relative(Path(watch.twin), file)
    lines = [f"{key} = {_text(value) if key == 'twin' else json.dumps(value)}" for key, value in said.items()]
    return ["[watch]", *lines, ""] if said else []


def _pacing(template: Template) -> list[str]:
    zero = f"zero_every = {template.zero_every}   # holds between zero returns"
    waits = [f"{key} = {float(value)!r}   # s" for key in WATER if (value := getattr(template, key))]
    waits += [f"cool_down = {{ {_inline(template.cool_down)} }}"] if template.cool_down is not None else []
    return [zero, f"rest = {float(template.rest)!r}   # s", f"slew = {float(template.slew)!r}   # V/s", *waits]


def _inline(cool: CoolDown) -> str:
    return (
        f"channel = {_text(cool.channel)}, below = {float(cool.below)!r}, longest = {float(cool.longest)!r}, "
        f"otherwise = {_text(cool.otherwise)}"
    )


def _levels(levels: Sequence[Held], template: Template) -> list[str]:
    longest = max(level.duration for level in levels)
    return [
        "[plan]",
        'kind = "levels"',
        "voltages = [   # V",
        *_rows([f"{float(level.voltage)!r}" for level in levels]),
        "]",
        "durations = [   # s at each, settling included",
        *_rows([f"{float(level.duration)!r}" for level in levels]),
        "]",
        *_pacing(template),
        "[plan.dwell]",
        'kind = "fixed"',
        f"duration = {float(longest)!r}   # s, the longest: each level has its own",
        f"settle = {float(template.settle)!r}   # s left out of each mean",
    ]


def _rows(numbers: Sequence[str]) -> list[str]:
    """Eight to a line."""
    return [f"    {', '.join(numbers[k : k + 8])}," for k in range(0, len(numbers), 8)]


def _write(path: Path, text: str) -> Path:
    """Write beside it, read back, then take its name: a file that the loader refuses replaces nothing."""
    from rig.campaign.loading import load_campaign

    part = path.with_name(f"{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        load_campaign(part)
        part.replace(path)
    except OSError as error:
        raise ConfigError(f"{path}: the plan can't be written: {error.strerror}; choose another place") from None
    finally:
        part.unlink(missing_ok=True)
    return path
