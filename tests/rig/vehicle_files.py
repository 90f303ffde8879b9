"""A small campaign of the simulated vehicle as files: surge only, front pair and all four, one sine."""

import json

import numpy as np

from rig.importing.one_file import import_plain
from sim_devices.vehicle import romeo
from sim_devices.vehicle.campaign import ALL, FRONT, REAR, sine, there_and_back
from sim_devices.vehicle.documents import recorded

C = {f"T{i}": 0.4 for i in range(1, 9)}
LEVELS = (8.0, 14.0, 20.0)
LAY_OUT = """
[vehicle]
name = "small ROMEO"
current = false
[thrusters]
T1 = { surge = 0.70710678, yaw = 0.6 }
T2 = { surge = 0.70710678, yaw = -0.6 }
T3 = { surge = 0.70710678, yaw = 0.6 }
T4 = { surge = 0.70710678, yaw = -0.6 }
[efficiencies.eta_hull]
backward = ["T1", "T2"]
forward = ["T3", "T4"]
[efficiencies.eta_pair]
pairs = [["T1", "T3"], ["T2", "T4"]]
"""


def documents(hull=None):
    trials = [
        there_and_back("front", "surge", FRONT, LEVELS), there_and_back("all", "surge", ALL, LEVELS),
        sine("surge", FRONT, 20.0, "sine"), sine("surge", REAR, 18.0, "check"),
        there_and_back("one", "surge", FRONT, (14.0,)),
    ]  # fmt: skip
    return recorded(hull or romeo(), trials, np.random.default_rng(5))


def write(folder, name, document):
    """A document as a recording; returns its path."""
    log = folder / f"{name}.json"
    log.write_text(json.dumps(document))
    import_plain(log, folder / f"{name}.h5")
    return folder / f"{name}.h5"


def fit_of(path, names=tuple(C), model="C V|V|", **more):
    """What `rig fit --json` writes of thrusters."""

    def parameter(value):
        return {"value": value, "std": 0.002, "std_statistical": 0.001, "std_calibration": 0.0017} | more

    keys = ("C",) if model == "C V|V|" else ("C_plus", "C_minus")
    fits = [
        {"thruster": n, "model": model, "parameters": {k: parameter(0.4) for k in keys}, "alternatives": []}
        for n in names
    ]
    path.write_text(json.dumps({"format": "thruster-rig-fit", "version": 1, "fits": fits}))
    return path
