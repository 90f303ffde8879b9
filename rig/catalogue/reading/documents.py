"""Entries of results: what `rig fit --json`, `rig diagnose --json` and `--save-twin` have written."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from rig.catalogue.entry import UNREADABLE, Entry, finite, seconds_of
from rig.catalogue.reading.recordings import short_id
from rig.errors import RecordingError
from rig.regular_file import read

FORMATS: Final = {
    "thruster-rig-fit": "fits",
    "thruster-rig-twin": "twins",
    "thruster-rig-diagnosis": "diagnoses",
}
LARGEST: Final = 32 * 2**20
"""Bytes; the fit of a hundred recordings has two million."""


def read_document(folder: Path, path: str) -> list[Entry]:
    """None for JSON of other programs; for a result of ours that can't be read one with the reason."""
    try:
        content = read(folder / path, "result", LARGEST, RecordingError)
    except (RecordingError, FileNotFoundError):
        return []
    what = next((FORMATS[name] for name in FORMATS if f'"{name}"'.encode() in content), "")
    if not what:
        return []
    try:
        found = json.loads(content)
        if not isinstance(found, dict) or FORMATS.get(found.get("format", "")) is None:
            return []
        return list(_READERS[FORMATS[found["format"]]](path, short_id(content), found))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        return [
            Entry(what, path, short_id(content), outcome=UNREADABLE, reason=f"not as it was written: {error!r:.200}")
        ]


def _fits(path: str, identity: str, found: Mapping[str, Any]) -> Iterator[Entry]:
    for fit in found["fits"]:
        parameters = {
            name: {"value": finite(p["value"]), "std": finite(p["std"]), "unit": str(p["unit"])}
            for name, p in fit["parameters"].items()
        }
        yield Entry(
            "fits",
            path,
            id=identity,
            thruster=str(fit["thruster"]),
            said="; ".join(_told(name, p) for name, p in parameters.items()),
            facts={
                "model": str(fit["model"]),
                "against": str(fit.get("voltage", "")),
                "parameters": parameters,
                "rmse": finite(fit.get("rmse")),
                "chi2_per_dof": finite(fit.get("chi2_per_dof")),
                "chi2_p": finite(fit.get("chi2_p")),
                "calibration": str(fit.get("calibration", "")),
            },
            recordings=_texts(fit["recordings"]),
        )


def _told(name: str, parameter: Mapping[str, Any]) -> str:
    value, std, unit = parameter["value"], parameter["std"], parameter["unit"]
    return f"{name} {'not determined' if value is None or std is None else f'{value:.5g} +- {2 * std:.2g} {unit}'}"


def _twins(path: str, identity: str, found: Mapping[str, Any]) -> Iterator[Entry]:
    effects = [str(term["effect"]) for term in found["terms"]]
    yield Entry(
        "twins",
        path,
        id=identity,
        thruster=str(found["thruster"]),
        stated=seconds_of(str(found.get("created", ""))),
        said=f"C {found['C']:.5g}" + (f" with {', '.join(effects)}" if effects else ""),
        facts={"C": finite(found["C"]), "effects": effects, "driver": str(found.get("driver", ""))},
        recordings=_texts([source["recording_id"] for source in found["recordings"]]),
    )


def _diagnoses(path: str, identity: str, found: Mapping[str, Any]) -> Iterator[Entry]:
    effects = [str(each["effect"]) for each in found["findings"]]
    headline = str(found.get("headline") or ", ".join(effects))
    yield Entry(
        "diagnoses",
        path,
        id=identity,
        thruster=str(found["thruster"]),
        outcome=str(found["verdict"]),
        said=headline if headline != found["verdict"] else str(found.get("statement", "")),
        facts={"verdict": str(found["verdict"]), "effects": effects, "statement": str(found.get("statement", ""))},
        recordings=_texts(found["recordings"]),
    )


def _texts(values: Any) -> tuple[str, ...]:
    return tuple(dict.fromkeys(str(each) for each in values))


_READERS: Final = {"fits": _fits, "twins": _twins, "diagnoses": _diagnoses}
