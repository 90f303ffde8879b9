"""How large things are in some runs: what terms scale their trials and bounds by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.calibration.bend import CellBend
from identification.physics.term import KELVIN, THERMOMETER, Scale
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun

MANY_SAMPLES = 100
"""Samples, above which scatter is told by second differences: fewer are compared level by level."""

STARTING_SHARE = 0.01
"""Of a run: what a current does for so short a time warms nothing."""


def scale_of(runs: Sequence[RememberedRun], C: float) -> Scale:
    """Sizes of these runs; C from a first fit."""
    histories = [run.history for run in runs]
    driver = max(h.size for h in histories)
    unit = "rev/s" if histories[0].driver_quantity == "rotation_rate" else "V"
    flows = [float(np.max(np.abs(h.others["flow_speed"]))) for h in histories if "flow_speed" in h.others]
    return Scale(
        driver=driver,
        driver_unit=unit,
        thrust=abs(C) * driver**2,
        duration=max(float(h.edges[-1] - h.edges[0]) for h in histories),
        interval=min(map(_resolution, runs)),
        flow=max(flows, default=0.0),
        reading=max(float(np.nanmax(np.abs(h.thrust))) for h in histories),
        noise=float(np.median([_scatter(h) for h in histories])),
        torque=_full_torque(histories) * driver**2,
        spacing=min(h.spacing for h in histories),
        bus=_largest(histories, "bus_voltage"),
        current=max((_lasting_current(h) for h in histories if "current" in h.others), default=0.0),
        neighbour=_largest(histories, "neighbour_thrust"),
        **_coldest(histories),
        **_straightness(histories),
    )


def _straightness(histories: Sequence[History]) -> dict[str, float]:
    """How straight the cell is known to be, as the least that is known of a run says; 0 where one says nothing."""
    bends = [h.cell for h in histories]
    return {
        f"cell_{name}": max(stds) if all(stds := [getattr(bend, name) for bend in bends]) else 0.0
        for name in CellBend._fields
    }


def _largest(histories: Sequence[History], quantity: str) -> float:
    """In the unit of the quantity, over all runs that hold it; 0 where none does."""
    sizes = (float(np.nanmax(np.abs(h.others[quantity]))) for h in histories if quantity in h.others)
    return max(sizes, default=0.0)


def _lasting_current(history: History) -> float:
    """A, exceeded in STARTING_SHARE of the time only: a rotor that is set going draws several times as much."""
    size = np.nan_to_num(np.abs(history.others["current"]))
    order = np.argsort(size)
    until = np.cumsum(history.dt[order])
    return float(size[order][np.searchsorted(until, (1 - STARTING_SHARE) * until[-1])])


def _coldest(histories: Sequence[History]) -> dict[str, float]:
    """K, the lowest that a run began with, and its standard error."""
    begun = [(_begun(h), h.begun_error) for h in histories if THERMOMETER in h.others]
    cold, error = min(begun, default=(0.0, 0.0))
    return {"cold": cold, "cold_error": error}


def _begun(history: History) -> float:
    """K, the motor temperature at the beginning."""
    return max(float(history.others[THERMOMETER][0]) + KELVIN, 0.0)


def of_one_rate(histories: Sequence[History], known: float | None = None) -> tuple[History, ...]:
    """The same with one rate per driver: with one of its own each, a rotor that is faster in one run than in another at
    the same command would not be seen. `known`: that of a twin or of other runs; None: the mean of these."""
    turning = [h.rate_per_driver for h in histories if h.rate is not None]
    if known is None and not turning:
        return tuple(histories)
    one = float(np.mean(turning)) if known is None else known
    return tuple(h if h.rate is None else replace(h, rate_per_driver=one) for h in histories)


def _full_torque(histories: Sequence[History]) -> float:
    """N m per unit of the driver squared; 0 where not every run has a torque. A peak while it starts counts little."""
    if not all("torque" in h.others for h in histories):
        return 0.0
    power = sum(float(np.sum(np.abs(h.others["torque"]) * h.driver**2 * h.dt)) for h in histories)
    size = sum(float(np.sum(h.driver**4 * h.dt)) for h in histories)
    return power / size if size > 0 else 0.0


def _resolution(run: RememberedRun) -> float:
    """s: the shorter intervals, or what the ticks of the command resolve."""
    dt = run.history.dt
    shortest = float(np.median(np.sort(dt)[: max(dt.size // 4, 1)]))
    return shortest if run.step_responses is None else min(shortest, run.step_responses.resolution)


def _scatter(history: History) -> float:
    """N: standard deviation of one sample, robust: from second differences, or of a table from neighbouring rows."""
    if not history.static and history.sample_thrust.size > MANY_SAMPLES:
        bent = np.abs(np.diff(history.sample_thrust, 2))
        return float(np.median(bent[np.isfinite(bent)]) / 0.6745 / np.sqrt(6.0))
    rows = history.rows
    same = np.diff(history.level_start[rows]) == 0
    weight = np.sqrt(1 / history.count[rows][1:] + 1 / history.count[rows][:-1])
    steps = (np.abs(np.diff(history.thrust[rows])) / weight)[same]
    return float(np.median(steps) / 0.6745) if steps.size > 10 else 0.0
