"""What a calibration leaves: a JSON file with curve, covariance and budget, and the bench file that names it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import date, timedelta
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any

from identification.calibration.answer import CellCalibration
from rig.calibrate.loads_file import LoadsPlan
from rig.calibrate.session import Taken
from rig.campaign.calibration_file import FORMAT, FORMAT_VERSION
from rig.campaign.loading import load_bench
from rig.editing.document import Document, require_toml
from rig.editing.saving import opened, saved


def as_json(
    found: CellCalibration,
    plan: LoadsPlan,
    taken: Sequence[Taken],
    device: tuple[str, str],
    recording: Mapping[str, str],
    day: date,
) -> dict[str, Any]:
    """All of it. `device`: name and identity; `recording`: `file`, `recording_id`, `sha256`."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "device": device[0],
        "device_id": device[1],
        "date": day.isoformat(),
        "valid_until": (day + timedelta(days=plan.about.valid_days)).isoformat(),
        "certificate": plan.about.certificate,
        "operator": plan.about.operator,
        "software": f"thruster-rig {version('thruster-rig')}",
        "recording": dict(recording),
        "curve": found.curve.as_json(),
        "gain": {name: _number(value) for name, value in asdict(found.gain).items()},
        "budget": [
            {"name": each.name, "kind": each.kind, "std": each.std, "dof": _number(each.dof)} for each in found.budget
        ],
        "terms": {
            each.name: {"value": each.value, "std": each.std, "unit": each.unit, "p_value": each.p_value}
            for each in found.terms
        },
        "creep_time_constant": found.time_constant,
        "age": found.age,
        "temperature": _number(found.temperature),
        "scatter": found.scatter,
        "steps": [
            {
                "index": step.index,
                "weights": list(step.load.weights),
                "force": step.force,
                "reading": step.reading,
                "residual": float(residual),
                "time": step.start,
                "temperature": _number(step.temperature),
            }
            for step, residual in zip(taken, found.residual, strict=True)
        ],
        "loads_toml": plan.text,
    }


def _number(value: float) -> float | None:
    return value if isfinite(value) else None


def write_result(path: Path, content: Mapping[str, Any]) -> None:
    """A new file. Raises FileExistsError, OSError."""
    with path.open("x", encoding="utf-8") as file:
        json.dump(content, file, indent=1, allow_nan=False)
        file.write("\n")


def name_in_bench(bench: Path, device: str, content: Mapping[str, Any], file: str) -> None:
    """`[calibration.<device>]` of the bench file; all else of it stays as it is. Raises ConfigError."""
    before = opened(bench)
    require_toml(bench, before.text)
    document = Document(before.text)
    at = ("calibration", device)
    document = document.with_value((*at, "date"), content["date"])
    document = document.with_value((*at, "valid_until"), content["valid_until"])
    if content["certificate"]:
        document = document.with_value((*at, "certificate"), json.dumps(content["certificate"]))
    document = document.with_value((*at, "file"), json.dumps(file))
    saved(before, document.text)
    load_bench(bench)  # what was written is what a campaign reads
