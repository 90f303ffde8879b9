"""Files of the examples with a dead band put in, and the commands run on them."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
from click.testing import CliRunner, Result

from rig.cli import rig

ROOT = Path(__file__).parents[3]


def example(name: str):
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


bad = example("diagnose_bad_input")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(rig, [str(a) for a in arguments])


def dead_band(columns: dict) -> None:
    """+-1.5 V put into the levels."""
    start, level, *_ = columns["command"]
    time, thrust, *named = columns["cell"]
    volts = level[np.searchsorted(start, time, side="right") - 1]
    acting = np.sign(volts) * np.maximum(np.abs(volts) - 1.5, 0.0)
    columns["cell"] = (time, thrust + 0.4 * (acting * np.abs(acting) - volts * np.abs(volts)), *named)


def with_line(folder, dead, **line):
    """The twin of the dead band with a periodic disturbance in its file."""
    told = {
        "kind": "fixed",
        "turns": "rev",
        "amplitude": {"value": 0.3, "std": 0.01, "unit": "N"},
        "frequency": {"value": 7.3, "std": 0.001, "unit": "Hz"},
        "ratio": None,
        "phase": {"value": 1.0, "std": 0.1, "unit": "rad"},
    }
    content = json.loads(dead[2].read_text()) | {"version": 2, "lines": [told | line]}
    path = folder / "line.twin.json"
    path.write_text(json.dumps(content))
    return path
