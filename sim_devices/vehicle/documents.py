"""What was recorded, and the truth, as plain documents for JSON, in the words of the recording format.

The world writes no HDF5. `python -m sim_devices vehicle` hands these documents to `rig import`, as the log of any
other program would be.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_devices.vehicle.body import Hull
from sim_devices.vehicle.campaign import ALL, BALLAST, REAR, heave_steady, sine, sines, surge_steady, sway_steady
from sim_devices.vehicle.campaign import yaw_steady as yaw
from sim_devices.vehicle.settings import Scalars
from sim_devices.vehicle.trials import Record, RecordedChannel, Trial, run_trials
from sim_devices.world.headless import Trace, run
from sim_devices.world.noise import Noise
from sim_devices.world.settings import Cell, Thruster, WorldSettings

Document = dict[str, Any]
FORMAT = {"format": "thruster-rig-recording", "format_version": 1}
LEVELS = (4.0, -4.0, 8.0, -8.0, 12.0, -12.0, 16.0, -16.0, 20.0, -20.0)
"""V of the tunnel runs."""
TARE, HOLD, REST = 6.0, 5.0, 4.0
"""s."""
CELL_RATE = 92.0
"""1/s, as an MT-SICS cell sends."""
CELL_NOISE = {"thrust": Noise(white=0.05, slow=0.02, slow_time=0.5, proportional=0.001)}
"""N: the cell of benches/simulated/world.toml."""


def tunnel(hull: Hull, scalars: Scalars, rng: np.random.Generator) -> dict[str, Document]:
    """One calibration run of each thruster alone in the tunnel."""
    return {name: _tunnel_run(name, mounted.C, scalars, rng) for name, mounted in hull.thrusters.items()}


def _tunnel_run(name: str, C: float, scalars: Scalars, rng: np.random.Generator) -> Document:
    """Tare, each level, tare."""
    steps: list[Document] = []
    at = 0.0
    for phase, V, length in (
        ("tare", 0.0, TARE),
        *(("hold", level, HOLD) for level in LEVELS),
        ("rest", 0.0, REST),
        ("tare", 0.0, TARE),
    ):
        steps.append({"phase": phase, "command_voltage": V, "t_start": at, "t_end": at + length})
        at += length
    cell = Cell(gain_error=scalars.cell_gain_error, zero_offset=float(rng.normal(0.0, 0.5)))
    world = WorldSettings({name: Thruster(C)}, name, cell=cell, noise=CELL_NOISE)
    times, volts = [s["t_start"] for s in steps], [s["command_voltage"] for s in steps]
    traces = run(world, times, volts, at, rates={"thrust": CELL_RATE}, rng=rng)
    streams = {
        "command": stream(np.array(times), {"command_voltage": _facts("command_voltage", "V", np.array(volts))}),
        "load_cell": _cell(traces["thrust"], scalars.cell_gain_std),
    }
    return {
        **FORMAT, "attributes": {"thruster": name, "kind": "tunnel", "facility": "simulated"},
        "streams": streams, "steps": steps,
    }  # fmt: skip


def _cell(trace: Trace, gain_std: float) -> Document:
    facts = _facts("thrust", "N", trace.value) | {"calibration": {"gain_std": gain_std}}
    return stream(trace.time, {"thrust": facts})


def stream(time: NDArray[np.float64], channels: Mapping[str, Document]) -> Document:
    """One stream of channels on a clock (n,) in s."""
    return {"source": "simulated", "time": time.tolist(), "channels": dict(channels)}


def _facts(quantity: str, unit: str, values: NDArray[np.float64]) -> Document:
    given = [value if isfinite(value) else None for value in values.tolist()]
    return {"quantity": quantity, "unit": unit, "value": given}


def trials() -> list[Trial]:
    """The whole campaign in the water."""
    steady = [*surge_steady(), *sway_steady(), *heave_steady(), *yaw()]
    return [*steady, *(one for axis in ("surge", "sway", "heave", "yaw") for one in sines(axis))]


def held_out() -> list[Trial]:
    """Trials to check an identified vehicle on: rear pair, and all four, where efficiencies matter."""
    return [sine("surge", REAR, 16.0, "check-rear"), sine("surge", ALL, 18.0, "check-all")]


def recorded(hull: Hull, wanted: Sequence[Trial], rng: np.random.Generator) -> dict[str, Document]:
    """Run trials; name -> document."""
    return {record.name: document(record) for record in run_trials(hull, wanted, rng)}


def document(record: Record) -> Document:
    """One trial as a recording. Channels of one stream share their clock."""
    streams: dict[str, Document] = {}
    for channel in record.channels:
        found = streams.setdefault(channel.stream, stream(channel.time, {}))
        found["channels"][channel.name] = _channel(channel)
    steps = [
        {"phase": s.phase, "command_voltage": s.command_voltage, "t_start": s.t_start, "t_end": s.t_end}
        for s in record.steps
    ]
    attributes = {"thruster": record.vehicle, "kind": "vehicle", "facility": "simulated", "trial": record.name}
    return {**FORMAT, "attributes": attributes, "streams": streams, "steps": steps}


def _channel(channel: RecordedChannel) -> Document:
    facts = {"thruster": channel.thruster, "axis": channel.axis, "noise_std": channel.noise_std}
    return _facts(channel.quantity, channel.unit, channel.value) | {k: v for k, v in facts.items() if v is not None}


def truth(hull: Hull) -> Document:
    """Parameters as `rig vehicle` names them; ballast as benches/romeo/installation.toml names it."""
    north, east = hull.current
    axes: dict[str, Document] = {}
    for axis, body in hull.axes.items():
        axes[axis] = {"m": body.inertia, "k": body.linear, "k2": body.quadratic}
        if axis != "heave":
            axes[axis] |= {"eta_hull": hull.eta_hull, "eta_pair": hull.eta_pair}
        if axis in ("surge", "sway"):
            axes[axis] |= {"current_north": north, "current_east": east}
    axes["heave"] |= {f"buoyancy[{i + 1}]": hull.buoyancy + weight for i, weight in enumerate(BALLAST)}
    constants = {f"C[{name}]": mounted.C for name, mounted in hull.thrusters.items()}
    return {"format": "simulated-vehicle-truth", "vehicle": hull.name, "axes": axes, "thrusters": constants}
