"""Columns into channels: expression, factor, sign and unit, each as the map says it, in the units of the format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.recording import Floats
from rig.errors import ConfigError, RecordingError
from rig.importing.expression import evaluate
from rig.importing.mapping import ChannelMap, ImportMap
from rig.importing.reading.cells import Cells, names_of
from rig.importing.units import FROM_HEADER, Conversion, conversion, unit_in


@dataclass(frozen=True, eq=False)
class ChannelData:
    """One channel on the rows of the file."""

    stream: str
    name: str
    facts: ChannelMap
    conversion: Conversion | None
    """From the unit of the map to that of the format; None for a channel without a quantity."""
    values: Floats
    """(rows,) in `unit`, NaN where nothing was measured."""
    sign: float = 1.0
    """What the map's `sign` stands for."""

    @property
    def unit(self) -> str:
        """As it is recorded."""
        return self.conversion.si if self.conversion is not None else self.facts.unit

    @property
    def source(self) -> str:
        """What of the file it is, for a reader."""
        if self.facts.value:
            return self.facts.value
        column = self.facts.column
        return f"column {column}" if isinstance(column, int) else repr(column)


def channels_of(plan: ImportMap, cells: Cells, parameters: Mapping[str, float]) -> tuple[ChannelData, ...]:
    """Every channel whose columns are there, in the map's order. Raises ConfigError or RecordingError."""
    scope: dict[str, Floats | float] = {**parameters, **cells.columns}
    return tuple(
        _channel(stream, name, facts, scope, parameters, cells.rows)
        for stream, owner in plan.streams.items()
        for name, facts in owner.channels.items()
        if all(used in scope for used in names_of(facts))
    )


def _channel(
    stream: str,
    name: str,
    facts: ChannelMap,
    scope: Mapping[str, Floats | float],
    parameters: Mapping[str, float],
    rows: int,
) -> ChannelData:
    raw = evaluate(facts.value, scope) if facts.value else np.asarray(scope[str(facts.column)], dtype=np.float64)
    given = np.broadcast_to(facts.factor * raw + facts.offset, (rows,)).astype(np.float64)
    change = None if facts.quantity is None else _conversion(f"{stream}/{name}", facts.quantity, facts, parameters)
    out = given if change is None else change.apply(given, parameters)
    sign = _sign(facts, parameters)
    out = sign * out
    if facts.unwrap:
        finite = np.isfinite(out)
        out[finite] = np.unwrap(out[finite])
    return ChannelData(stream, name, facts, change, out, sign)


def _conversion(who: str, quantity: str, facts: ChannelMap, parameters: Mapping[str, float]) -> Conversion:
    unit = facts.unit
    if unit == FROM_HEADER:
        unit = unit_in(str(facts.column))
        if not unit:
            raise RecordingError(f"{who}: no unit in brackets at the end of {facts.column!r}; write it into the map")
    try:
        found = conversion(quantity, unit)
    except ConfigError as error:
        raise ConfigError(f"{who}: {error}") from error
    lacking = [name for name in found.needs if name not in parameters]
    if lacking:
        example = {"pulse_stop": 1500, "pulse_span": 400, "nominal_voltage": 16, "pole_pairs": 7}
        say = " ".join(f"--set {name}={example[name]}" for name in lacking)
        raise ConfigError(
            f"{who}: {quantity} in {unit} becomes {found.si} by {found.said}; the map does not say "
            f"{' nor '.join(lacking)}: put it into [parameters], or for example {say}"
        )
    return found


def _sign(facts: ChannelMap, parameters: Mapping[str, float]) -> float:
    """1 or -1. Raises ConfigError where a parameter that stands for it is something else."""
    if not isinstance(facts.sign, str):
        return float(facts.sign)
    value = parameters[facts.sign]
    if value not in (1.0, -1.0):
        raise ConfigError(f"{facts.sign} must be 1 or -1, got {value:g}; for a scale use factor")
    return value
