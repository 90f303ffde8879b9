"""The report of `rig vehicle`: per axis the parameters, the drag with the efficiency, trials simulated, the inertia."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from identification.inertia import InertiaFit, responses
from identification.inertia_by_derivative import smoothed
from identification.recording import Floats
from identification.thrust_data import Unusable
from identification.vehicle import DragFit
from identification.vehicle_campaign import AxisResult, VehicleFit
from identification.vehicle_report import COVER_95, Row, rows
from identification.vehicle_simulation import current_along
from rig.report import figures, figures_vehicle, provenance
from rig.report.figures import Curve, Group, Interval
from rig.report.fit import tone, value_and_interval
from rig.report.look import prose, unit_text
from rig.report.page import Page, Picture, Remark, Section, Table, columns, sentences, write

GRID = 121
MOST_TRIALS = 2
"""Trials drawn of one axis."""
SPEED = {"yaw": "rate / (rad/s)"}
FORCE = {"yaw": "torque / (N·m)"}
PLACE = {"yaw": "heading / rad", "heave": "depth / m"}


def write_report(fit: VehicleFit, path: Path, files: Sequence[Path] = (), name: str = "") -> None:
    """One page of all axes. `files`: the recordings, to be hashed. Raises RecordingError, OSError."""
    write(vehicle_page(fit, provenance.sources(files), name), path)


def vehicle_page(fit: VehicleFit, found: Sequence[provenance.Source] = (), name: str = "") -> Page:
    """The page of an identified vehicle."""
    parts = [axis_section(result) for result in fit.axes.values()]
    unused = tuple(f"recording {one} was not used: no thruster of the lay-out is commanded in it" for one in fit.unused)
    if unused:
        parts.append(Section("Not used", sentences(unused)))
    ids = list(dict.fromkeys(one for result in fit.axes.values() for one in _recordings(result)))
    parts.append(provenance.section(found, ids))
    return Page(f"Identification of {name or 'the vehicle'}", _lead(fit), tuple(parts), contents=len(parts) > 2)


def _recordings(result: AxisResult) -> Iterator[str]:
    if not isinstance(result.drag, Unusable):
        yield from (run.recording_id for run in result.drag.runs)
    yield from (one.recording_id for one in result.moving)


def _lead(fit: VehicleFit) -> str:
    done = [axis for axis, result in fit.axes.items() if not isinstance(result.inertia, Unusable)]
    partly = [axis for axis in fit.axes if axis not in done]
    told = [f"Drag and inertia were identified for {_listed(done)}" if done else "No axis was identified completely"]
    if partly:
        told.append(f"not all of {_listed(partly)}")
    etas = {row.name: row for result in fit.axes.values() for row in _rows(result) if row.name.startswith("eta")}
    said = [
        f"{row.name} = {value_and_interval(row.value, row.std, row.low, row.high)[0]}"
        for row in etas.values()
        if row.determined
    ]
    return f"{'; '.join(told)}{f'; efficiencies: {_listed(said)}' if said else ''}."


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _rows(result: AxisResult, *, calibration: bool = False) -> tuple[Row, ...]:
    return () if result.estimate is None else rows(result.estimate, result.axis, calibration)


def axis_section(result: AxisResult) -> Section:
    """Both steps of one axis."""
    refused = [Remark(found.reason, "bad") for found in (result.drag, result.inertia) if isinstance(found, Unusable)]
    fits = [found for found in (result.drag, result.inertia) if not isinstance(found, Unusable)]
    said = [_remark(text, result.axis) for found in fits for text in found.verdicts]
    judged = Section(f"What to know of {result.axis}", sentences((*refused, *said)))
    etas = [Interval(row.name, row.value, row.low, row.high) for row in _rows(result) if row.name.startswith("eta")]
    drawn: list[Picture] = []
    if not isinstance(result.drag, Unusable):
        drawn += drag_pictures(result.drag)
    if not isinstance(result.inertia, Unusable):
        drawn += inertia_pictures(result, result.inertia)
    if etas:
        plot = figures.forest(etas, "efficiency, 1 is the thrust in the tunnel", 1.0)
        drawn.append(Picture("Efficiencies", plot, "Share of the tunnel's thrust that reaches the vehicle."))
    return Section(result.axis.capitalize(), (*_tables(result), *((judged,) if refused or said else ()), *drawn))


def _remark(text: str, axis: str) -> Remark:
    return Remark(prose(text.removeprefix(f"{axis}: ")), tone(text))


def _tables(result: AxisResult) -> tuple[Table, ...]:
    head = ("parameter", "value ± std", "95 % interval", "unit", "verdict")
    words = columns(head, "parameter", "unit", "verdict")
    out = []
    for caption, calibration in ((f"Parameters of {result.axis}", False), ("Thrusters as used", True)):
        cells = tuple(
            (row.name, *value_and_interval(row.value, row.std, row.low, row.high), unit_text(row.unit), row.verdict)
            for row in _rows(result, calibration=calibration)
        )
        if cells:
            out.append(Table(caption, head, cells, words, folded=calibration))
    return tuple(out)


def drag_pictures(fit: DragFit) -> list[Picture]:
    """Drag curve with the efficiency, and what is left of each run's velocity."""
    names, theta = fit.estimate.names, fit.estimate.mean[None]
    drift = [float(current_along(names, theta, run.axis, run.heading)[0]) for run in fit.runs]
    water = np.array([run.velocity for run in fit.runs]) - np.array(drift)
    push = np.array([(run.force.weights(names, theta) @ run.force.signal)[0, 0] for run in fit.runs])
    lift = [fit.estimate[fit.buoyancy[run.recording_id]] if fit.buoyancy else 0.0 for run in fit.runs]
    promised = np.array([run.force.nominal()[0] for run in fit.runs])
    force, speed = FORCE.get(fit.axis, "force / N"), SPEED.get(fit.axis, "velocity / (m/s)")
    through = speed.replace(" /", " through the water /", 1)
    arriving = Group("arrives", water, push + np.array(lift))
    nominal = Group("promised by the tunnel", water, promised + np.array(lift)) if fit.etas else None
    left = np.array([run.velocity for run in fit.runs]) - fit.predicted
    half = COVER_95 * np.hypot(np.array([run.std for run in fit.runs]), fit.excess_std)
    return [
        Picture(
            f"Drag in {fit.axis}",
            figures_vehicle.drag_curve(arriving, nominal, drag_band(fit, water), through, force),
            "In a steady run the thrust that arrives balances the drag; buoyancy and current are allowed for.",
        ),
        Picture(
            f"Velocities that the fit leaves over in {fit.axis}",
            figures.residuals([Group("runs", arriving.y, left, half)], force, f"residual {speed}"),
            "Bars are 95 % intervals of each run's velocity. A shape here is a drag that is not linear and quadratic.",
        ),
    ]


def drag_band(fit: DragFit, velocity: Floats) -> Curve:
    """Drag k xi + k2 |xi| xi with its 95 % band; without a band where the data do not determine it."""
    low, high = min(float(velocity.min()), 0.0), max(float(velocity.max()), 0.0)
    xi = np.linspace(1.05 * low, 1.05 * high, GRID)
    basis = np.column_stack([xi, xi * np.abs(xi)])
    known = fit.estimate.select(("k", "k2"))
    y = basis @ known.mean
    half = COVER_95 * np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", basis, known.cov, basis), 0.0))
    if not np.all(np.isfinite(half)):
        return Curve("drag", xi, y)
    return Curve("drag", xi, y, y - half, y + half)


def inertia_pictures(result: AxisResult, fit: InertiaFit) -> list[Picture]:
    """Trials simulated with the best estimate, and acceleration over force."""
    if fit.maximum is None or not result.moving:
        return []
    theta = fit.maximum.estimate
    found = responses(result.moving, theta.names, theta.mean[None], result.ballast)
    simulated = [y[0] for y in found]
    out = []
    for one, y in list(zip(result.moving, simulated, strict=True))[:MOST_TRIALS]:
        place = SPEED.get(fit.axis, "speed / (m/s)") if one.quantity == "speed" else PLACE.get(fit.axis, "position / m")
        trial = figures_vehicle.Simulated(one.recording_id, one.time, one.response, y)
        fitted = "The simulation sees the commands and how the trial began, nothing else."
        title = f"Trial {one.recording_id}, simulated"
        out.append(Picture(title, figures_vehicle.simulated_trial(trial, place), fitted))
    return [*out, *_inertia_line(result, fit, simulated)]


def _inertia_line(result: AxisResult, fit: InertiaFit, simulated: Sequence[Floats]) -> list[Picture]:
    """Force less drag is m times the acceleration of the simulated vehicle; both sides go through the same filters."""
    m, std = fit.estimate["m"], fit.estimate.std_of("m")
    force, acceleration = [], []
    for one, y in zip(result.moving, simulated, strict=True):
        seen, made = smoothed(one), smoothed(replace(one, response=y))
        if seen is not None and made is not None:
            force.append(m * made.acceleration)
            acceleration.append(seen.acceleration)
    if not force or not np.isfinite(std) or m <= COVER_95 * std:
        return []
    x = np.concatenate(force)
    grid = np.linspace(float(x.min()), float(x.max()), GRID)
    ends = np.stack([grid / (m - COVER_95 * std), grid / (m + COVER_95 * std)])
    yaw = fit.axis == "yaw"
    unit = "kg·m²" if yaw else "kg"
    curve = Curve(f"m = {m:.4g} {unit}", grid, grid / m, ends.min(axis=0), ends.max(axis=0))
    points = Group("measured, smoothed", x, np.concatenate(acceleration))
    across = "torque less drag / (N·m)" if yaw else "force less drag / N"
    up = "acceleration / (rad/s²)" if yaw else "acceleration / (m/s²)"
    caption = "The slope is one over the inertia; the fit itself is to the trials above, not to these derivatives."
    return [Picture(f"Inertia in {fit.axis}", figures_vehicle.inertia_line(points, curve, across, up), caption)]
