"""A campaign's fits beside the constants of the world they were measured in. Reads the two files; knows no rig."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SUSPICIOUS = 4.0
"""Standard errors between fit and truth that chance makes once in 16,000: then something is wrong."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """One thruster: N/V^2 all of them."""

    thruster: str
    fitted: float
    std: float
    low: float
    high: float
    true: float

    @property
    def z(self) -> float:
        return (self.fitted - self.true) / self.std

    @property
    def inside(self) -> bool:
        """Does the stated 95 % interval hold the truth?"""
        return self.low <= self.true <= self.high


def compare(fits: Path, true_constants: dict[str, float]) -> list[Comparison]:
    """Rows of a `thruster-rig-fit` file whose model is `C V|V|`."""
    document: dict[str, Any] = json.loads(fits.read_text(encoding="utf-8"))
    rows = []
    for fit in document["fits"]:
        C = fit["parameters"]["C"]
        low, high = C["interval_95"]
        rows.append(Comparison(fit["thruster"], C["value"], C["std"], low, high, true_constants[fit["thruster"]]))
    return rows


def table(rows: list[Comparison]) -> str:
    """Plain text, one line per thruster."""
    lines = ["thruster   C fitted   std. error   95 % interval         C of the bench   truth is"]
    for row in rows:
        verdict = "inside" if row.inside else "outside (one in twenty is)"
        lines.append(
            f"{row.thruster:<8} {row.fitted:>10.5f} {row.std:>12.5f}   {row.low:.5f} .. {row.high:.5f}"
            f" {row.true:>16.5f}   {verdict}, {row.z:+.1f} std. errors off"
        )
    return "\n".join([*lines, "C in N/V^2"])
