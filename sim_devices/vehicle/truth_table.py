"""An identified vehicle beside the one that was simulated. Reads the two files; knows no rig."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sim_devices.tables import WorldError


@dataclass(frozen=True, slots=True)
class Comparison:
    """One parameter of one axis."""

    axis: str
    name: str
    unit: str
    true: float
    value: float
    std: float
    low: float
    high: float

    @property
    def z(self) -> float:
        return (self.value - self.true) / self.std

    @property
    def inside(self) -> bool:
        """Does the stated 95 % interval hold the truth?"""
        return self.low <= self.true <= self.high


def compare(truth: Path, answer: Path) -> list[Comparison]:
    """Rows for every parameter that both files have and the data determined. Raises WorldError."""
    true, found = _read(truth, "axes"), _read(answer, "axes")
    rows = []
    for axis, result in found["axes"].items():
        for name, p in result["parameters"].items():
            known = true["axes"].get(axis, {}).get(name)
            if known is not None and p["std"] is not None:
                low, high = p["interval_95"]
                rows.append(Comparison(axis, name, p["unit"], known, p["value"], p["std"], low, high))
    return rows


def _read(path: Path, key: str) -> dict[str, Any]:
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise WorldError(f"{path}: {error}") from None
    if not isinstance(content, dict) or key not in content:
        raise WorldError(f"{path}: expected JSON with {key!r}: truth.json, and what `rig vehicle --json` wrote")
    return content


def table(rows: list[Comparison]) -> str:
    """Plain text, one line per parameter."""
    lines = [f"{'':7}{'parameter':16}{'truth':>10}{'estimate':>11}{'std':>10}  {'unit':15}95 % interval holds it"]
    for row in rows:
        said = "yes" if row.inside else "no (one in twenty does not)"
        lines.append(
            f"{row.axis:7}{row.name:16}{row.true:>10.4g}{row.value:>11.4g}{row.std:>10.2g}  {row.unit:15}"
            f"{said}, {row.z:+.1f} std. errors off"
        )
    inside = sum(row.inside for row in rows)
    return "\n".join([*lines, f"{inside} of {len(rows)} intervals hold the truth"])
