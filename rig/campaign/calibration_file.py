"""The file that `rig calibrate` writes beside the bench file: the curve of a load cell, and where it comes from."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from identification.calibration.curve import Curve, curve_of
from rig.errors import ConfigError
from rig.regular_file import read

FORMAT: Final = "thruster-rig-calibration"
FORMAT_VERSION: Final = 1
MOST_BYTES: Final = 2**22


@dataclass(frozen=True)
class CalibratedCell:
    """One load cell as it was calibrated."""

    path: Path
    curve: Curve
    identity: str
    """What the device said it is."""
    recording_id: str
    """Of the readings."""


def read_cell(path: Path, device: str) -> CalibratedCell:
    """Raises ConfigError for what is no calibration of that device, with what to do."""
    again = "calibrate again with `rig calibrate`, or take `file` out of the bench file"
    try:
        facts = json.loads(read(path, "calibration", MOST_BYTES, ConfigError))
    except FileNotFoundError:
        raise ConfigError(f"{path}: calibration.{device}.file names it, but there is no such file; {again}") from None
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: this calibration is no JSON ({error}); {again}") from None
    if not isinstance(facts, dict) or facts.get("format") != FORMAT:
        raise ConfigError(f"{path}: expected a file with the format {FORMAT!r}; {again}")
    version = facts.get("format_version")
    if version != FORMAT_VERSION:
        raise ConfigError(f"{path}: this calibration is of format_version {version!r}; this rig reads {FORMAT_VERSION}")
    if facts.get("device") != device:
        raise ConfigError(f"{path}: is a calibration of the device {facts.get('device')!r}, not of {device!r}; {again}")
    try:
        curve = curve_of(facts.get("curve"))
    except ValueError as error:
        raise ConfigError(f"{path}: {error}; {again}") from None
    recording = facts.get("recording")
    recording_id = recording.get("recording_id", "") if isinstance(recording, dict) else ""
    return CalibratedCell(path, curve, str(facts.get("device_id", "")), str(recording_id))
