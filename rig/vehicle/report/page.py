"""The report of `rig vehicle`: per axis the parameters, the drag with the efficiency, trials simulated, the inertia."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from identification.recording import Floats
from identification.thruster.thrust_data import Unusable
from identification.vehicle.campaign import AxisResult, VehicleFit
from identification.vehicle.inertia import InertiaFit, responses
from identification.vehicle.inertia_by_derivative import smoothed
from identification.vehicle.report import COVER_95, Row, rows
from identification.vehicle.simulation import current_along
from identification.vehicle.steady_drag import DragFit
from rig.fit.report.comparisons import value_and_interval
from rig.fit.report.page import tone
from rig.report import provenance, regression_figures
from rig.report.mismatch_figures import Panel, before_after
from rig.report.page import Page, Picture, Remark, Section, Table, columns, sentences, write
from rig.report.regression_figures import Curve, Group, Interval
from rig.report.style import prose, unit_text
from rig.vehicle.answer import HeldOut, VehicleAnswer
from rig.vehicle.report import figures
from rig.vehicle.text import rms_of, unit_of_response

GRID = 121
MOST_TRIALS = 2
"""Trials drawn of one axis."""
SPEED = {"yaw": "rate / (rad/s)"}
FORCE = {"yaw": "torque / (N·m)"}
PLACE = {"yaw": "heading / rad", "heave": "depth / m"}


def write_report(answer: VehicleAnswer, path: Path) -> None:
    """One page of all axes; the recordings are hashed. Raises RecordingError, OSError."""
    files = [one.path for one in answer.recordings]
    write(vehicle_page(answer, provenance.sources(files)), path)


def vehicle_page(answer: VehicleAnswer, found: Sequence[provenance.Source] = ()) -> Page:
    """The page of an identified vehicle."""
    fit = answer.fit
    parts = [axis_section(result, answer) for result in fit.axes.values()]
    parts += held_out_section(answer.held_out)
    unused = [f"Recording {one} was not used: no thruster of the lay-out is commanded in it." for one in fit.unused]
    if unused or answer.notes:
        parts.append(Section("Notes", sentences((*answer.notes, *unused))))
    parts.append(provenance.section(found, [one.uuid for one in answer.recordings]))
    return Page(f"Identification of {answer.vehicle or 'the vehicle'}", _lead(fit), tuple(parts), contents=True)


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


def axis_section(result: AxisResult, answer: VehicleAnswer) -> Section:
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
        plot = regression_figures.forest(etas, "efficiency, 1 is the thrust in the tunnel", 1.0)
        drawn.append(Picture("Efficiencies", plot, "Share of the tunnel's thrust that reaches the vehicle."))
    return Section(
        result.axis.capitalize(),
        (*_tables(result), *simulations(result, answer), *((judged,) if refused or said else ()), *drawn),
    )


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
            figures.drag_curve(arriving, nominal, drag_band(fit, water), through, force),
            "In a steady run the thrust that arrives balances the drag; buoyancy and current are allowed for.",
        ),
        Picture(
            f"Velocities that the fit leaves over in {fit.axis}",
            regression_figures.residuals([Group("runs", arriving.y, left, half)], force, f"residual {speed}"),
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
        place = response_label(fit.axis, one.quantity)
        trial = figures.Simulated(one.recording_id, one.time, one.response, y)
        fitted = "The simulation sees the commands and how the trial began, nothing else."
        title = f"Trial {one.recording_id}, simulated"
        out.append(Picture(title, figures.simulated_trial(trial, place), fitted))
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
    return [Picture(f"Inertia in {fit.axis}", figures.inertia_line(points, curve, across, up), caption)]


def simulations(result: AxisResult, answer: VehicleAnswer) -> tuple[Table, ...]:
    """How well each trial is simulated, and the inertia by other ways, folded; nothing where nothing was asked for."""
    out = []
    replays = answer.replays.get(result.axis, ())
    if replays:
        head = ("trial", "off by, rms", "unit", "fit / %")
        checks = [(one, one.validation) for one in replays]
        cells = tuple(
            (one.recording_id, f"{check.rmse:.3g}", unit_of_response(result.axis, one.quantity), f"{check.fit:.2f}")
            for one, check in checks
        )
        out.append(Table(f"Trials of {result.axis}, simulated", head, cells, columns(head, "trial", "unit"), True))
    rivals = answer.comparators.get(result.axis, ())
    if rivals:
        head = ("method", "m ± std", "95 % interval", "off by, rms")
        cells = tuple(_rival(one) for one in (result.inertia, *rivals))
        out.append(Table(f"Inertia of {result.axis} by other ways", head, cells))
    return tuple(out)


def _rival(one: InertiaFit | Unusable) -> tuple[str, str, str, str]:
    if isinstance(one, Unusable):
        return one.reason, "–", "–", "–"
    m, std = one.estimate["m"], one.estimate.std_of("m")
    return one.method, *value_and_interval(m, std, m - COVER_95 * std, m + COVER_95 * std), f"{rms_of(one):.3g}"


def held_out_section(found: Sequence[HeldOut]) -> tuple[Section, ...]:
    """Recordings that were not fitted; nothing where there are none."""
    if not found:
        return ()
    head = ("recording", "axis", "off by, rms", "without efficiencies", "unit", "fit / %")
    cells, drawn = [], []
    for one in found:
        check = one.replay.validation
        without = "" if one.without is None else f"{one.without.validation.rmse:.3g}"
        unit = unit_of_response(one.axis, one.replay.quantity)
        cells.append((one.name, one.axis, f"{check.rmse:.3g}", without, unit, f"{check.fit:.2f}"))
        drawn.append(_held_out_picture(one))
    told = Table("Simulated, not fitted", head, tuple(cells), columns(head, "recording", "axis", "unit"))
    lead = "The simulation sees the commands and how the recording began; nothing of these was used in the fit."
    return (Section("Held out", (told, *drawn[:MOST_TRIALS]), lead),)


def _held_out_picture(one: HeldOut) -> Picture:
    seen, y = one.replay, response_label(one.axis, one.replay.quantity)
    if one.without is None:
        plot = figures.simulated_trial(figures.Simulated(one.name, seen.time, seen.measured, seen.simulated), y)
        return Picture(f"{one.name}, {one.axis}", plot)
    panel = Panel(one.name, seen.time, seen.measured, one.without.simulated, seen.simulated)
    caption = "Before: identified as if every thruster gave what it gave in the tunnel. After: with the efficiencies."
    return Picture(f"{one.name}, {one.axis}", before_after(panel, y), caption)


def response_label(axis: str, quantity: str) -> str:
    """Axis label of what was measured.

    >>> response_label("yaw", "position"), response_label("surge", "speed"), response_label("sway", "position")
    ('heading / rad', 'speed / (m/s)', 'position / m')
    """
    if quantity == "speed":
        return SPEED.get(axis, "speed / (m/s)")
    return PLACE.get(axis, "position / m")
