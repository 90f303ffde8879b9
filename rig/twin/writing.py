"""A twin into its file: JSON, `thruster-rig-twin` version 1 or 2, with the hashes of the recordings it is of."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from identification.twin import Alternative, Twin, TwinLine, TwinTerm

FORMAT = "thruster-rig-twin"
VERSION = 2
"""2 has lines; what has none is written as 1, for earlier programs that would drop them unseen."""


def twin_json(twin: Twin) -> dict[str, object]:
    """Everything that is in the file."""
    return {
        "format": FORMAT,
        "version": VERSION if twin.lines else 1,
        "thruster": twin.thruster,
        "driver": twin.driver_quantity,
        "C": twin.C,
        **({} if twin.constant_interval is None else {"C_interval": list(twin.constant_interval)}),
        "terms": [_term_json(t) for t in twin.terms],
        "covariance": {"names": list(twin.names), "matrix": [list(row) for row in twin.covariance]},
        "noise": asdict(twin.noise),
        **({"lines": [_line_json(line) for line in twin.lines]} if twin.lines else {}),
        **({"alternatives": [_alternative(each) for each in twin.alternatives]} if twin.alternatives else {}),
        "recordings": [asdict(source) for source in twin.sources],
        "interval": twin.interval,
        "highest_driver": twin.highest_driver,
        "rate_per_driver": twin.rate_per_driver,
        "slip_rate_per_driver": twin.slip_rate_per_driver,
        "created": twin.created,
        "software": twin.software,
    }


def _term_json(t: TwinTerm) -> dict[str, object]:
    return {
        "effect": t.effect,
        "form": t.form,
        **({} if t.flexible is None else {"flexible": asdict(t.flexible)}),
        "parameters": _with_units(t),
        "scale": asdict(t.scale),
    }


def _alternative(other: Alternative) -> dict[str, object]:
    return {"C": other.C, "loss": other.loss, "gain": other.gain, "terms": [_term_json(t) for t in other.terms]}


def _line_json(line: TwinLine) -> dict[str, object]:
    def entry(value: float, std: float, unit: str) -> dict[str, object]:
        return {"value": value, "std": std, "unit": unit}

    return {
        "kind": line.kind,
        "turns": line.turns,
        "amplitude": entry(line.amplitude, line.amplitude_std, "N"),
        "frequency": entry(line.frequency, line.frequency_std, "Hz"),
        "ratio": None if line.ratio is None else entry(line.ratio, line.ratio_std, f"1/({line.turns})"),
        "phase": None if line.phase is None else entry(line.phase, line.phase_std, "rad"),
        **({"growth": line.growth, "at_speed": line.at_speed} if line.growth else {}),
    }


def _with_units(term: TwinTerm) -> dict[str, object]:
    units = {p.name: p.unit for p in term.term.parameters(term.scale)}
    return {name: {"value": value, "unit": units[name]} for name, value in term.parameters.items()}


def stamped(twin: Twin, paths: Mapping[str, Path]) -> Twin:
    """With the time, this program's version, names and hashes of the files: `paths` by recording id."""
    sources = tuple(
        replace(
            s,
            sha256=hashlib.sha256(paths[s.recording_id].read_bytes()).hexdigest(),
            file=paths[s.recording_id].name,
        )
        if s.recording_id in paths
        else s
        for s in twin.sources
    )
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return replace(twin, sources=sources, created=now, software=f"thruster-rig {_version()}")


def _version() -> str:
    try:
        return version("thruster-rig")
    except PackageNotFoundError:
        return "(not installed)"


def write_twin(twin: Twin, path: Path) -> None:
    """Overwrites: a twin is a result, not a measurement."""
    path.write_text(json.dumps(twin_json(twin), indent=1, allow_nan=False) + "\n", encoding="utf-8")
