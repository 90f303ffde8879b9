"""The figures of a diagnosis: where, what, before and after, the next sweep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from identification.mismatch.compare.reported_runs import Run
from identification.mismatch.compare.signature import SPREAD_OUT, Signature, profile, signature
from identification.mismatch.compare.signature import shape as shape_of
from identification.mismatch.diagnosis import (
    Curves,
    Diagnosis,
    Finding,
    NextExperiment,
)
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import Where, told_rows
from rig.diagnose.report.figures import residual_size, shape, signature_over, steps_plot
from rig.diagnose.report.words import KINDS, axis, driver_quantity, effect_name, evidence, not_drawn, stretch, words
from rig.diagnose.text import baseline_name
from rig.report.mismatch_figures import Panel, Region, before_after, grid_of, residual_map
from rig.report.page import Picture
from rig.report.regression_figures import Curve, Group
from rig.report.style import Plot

FEW = 40
"""Rows below which a run is a table of levels: points instead of a map over time."""
TWO_SIDED = frozenset({"direction", "direction_of_change"})
"""Coordinates of two or three values: a sentence says it all."""
MOST_SHARE = 1.5
"""A larger share of a thrust or of a step is none: it is drawn in newtons."""
MOST_MAPS = 2
MOST_PANELS = 3
Ends = tuple[float, float]


def largest(curves: Sequence[Curves], most: int) -> tuple[Curves, ...]:
    """The runs in which the baseline fails most, in their own order."""
    size = [float(np.sum((c.thrust - c.baseline) ** 2)) for c in curves]
    chosen = sorted(np.argsort(size)[::-1][:most])
    return tuple(curves[i] for i in chosen)


def _of(run: Curves, d: Diagnosis) -> str:
    ids = [c.recording_id for c in d.curves]
    return "" if len(ids) == 1 else f", run {ids.index(run.recording_id) + 1} of {len(ids)}"


def _is_levels(run: Curves) -> bool:
    """A table of levels, or one sweep in one direction: over time there is no more to see than over the level."""
    return run.time.size < FEW or bool(np.all(np.diff(run.driver) >= 0) or np.all(np.diff(run.driver) <= 0))


def where_pictures(d: Diagnosis, runs: Sequence[Run]) -> Iterator[Picture]:
    """Maps with the located region, then the size of the residual along each located coordinate."""
    region = _region(d)
    for run in largest(d.curves, MOST_MAPS):
        yield _level_picture(run, d, region) if _is_levels(run) else _map(run, d, region)
    driver = driver_quantity(d)
    drawn = {driver} if all(map(_is_levels, d.curves)) else set()
    for mismatch in d.mismatch:
        found = _located(mismatch.where, runs, driver)
        if found is not None and mismatch.where.quantity not in drawn:
            drawn.add(mismatch.where.quantity)
            yield found


def _region(d: Diagnosis) -> Region | None:
    """The mismatch that can be outlined on a map and holds most of the residual in the least of it."""
    places = [(each.share, Region(stretch(each.where), *_spans(each.where, driver_quantity(d)))) for each in d.mismatch]
    drawn = [(share / _part(region, d.curves), region) for share, region in places if region.time or region.voltage]
    return max(drawn, key=lambda each: each[0])[1] if drawn else None


def _spans(where: Where, driver: str) -> tuple[Ends | None, Ends | None]:
    """Over time and over the driver."""
    span = (where.low, where.high)
    return span if where.quantity == "time" else None, span if where.quantity == driver else None


def _part(region: Region, runs: Sequence[Curves]) -> float:
    """Of the rows of all runs, those within; at least one."""
    over = [(region.time, run.time) if region.time else (region.voltage, run.driver) for run in runs]
    inside = sum(int(np.sum((x >= span[0]) & (x <= span[1]))) for span, x in over if span is not None)
    return max(inside, 1) / max(sum(run.time.size for run in runs), 1)


def _clipped(region: Region | None, run: Curves) -> Region | None:
    """Within what this run measured."""
    if region is None:
        return None
    ends = tuple(
        None if span is None else (max(span[0], float(x.min())), min(span[1], float(x.max())))
        for span, x in ((region.time, run.time), (region.voltage, run.driver))
    )
    return None if any(span is not None and span[0] >= span[1] for span in ends) else Region(region.label, *ends)


def _map(run: Curves, d: Diagnosis, region: Region | None) -> Picture:
    grid = grid_of(run.time, run.driver, run.thrust - run.baseline)
    y = axis("driver", driver_quantity(d))
    plot = residual_map(grid, _clipped(region, run), "residual / N", "time / s", y)
    more = len(d.curves) - MOST_MAPS
    caption = (
        f"Measured thrust less {baseline_name(d)} with its best C and tare. A band across is a matter of the level, an "
        "upright one of time; both signs side by side at one level are a matter of what went before."
    )
    if more > 0:
        caption += f" The {MOST_MAPS} runs with the largest residual of {len(d.curves)} are shown."
    return Picture(f"Residual of the baseline{_of(run, d)}", plot, words(caption))


def _level_picture(run: Curves, d: Diagnosis, region: Region | None) -> Picture:
    groups = [
        Group(name, run.driver, run.thrust - predicted)
        for name, predicted in (("before", run.baseline), ("after", run.model))
    ]
    located = _clipped(region, run)
    span = located.voltage if located is not None else None
    plot = shape(groups, axis("driver", driver_quantity(d)), "residual / N", span, wide=True)
    caption = f"{run.time.size} levels, each met once. Before: {baseline_name(d)}; after: the model."
    return Picture(f"Residual level by level{_of(run, d)}", plot, caption)


def _located(where: Where, runs: Sequence[Run], driver: str) -> Picture | None:
    quantity = "driver" if where.quantity == driver else where.quantity
    found = profile(runs, quantity)
    if found is None or quantity in TWO_SIDED:
        return None
    before, after = Group("before", found.at, found.before), Group("after", found.at, found.after)
    spread_out = quantity in SPREAD_OUT
    low = max(where.low, float(found.at.min()) if spread_out else where.low)
    span = (low, where.high) if low < where.high else None
    x = axis(quantity, driver)
    plot = residual_size(before, after, x, "RMS residual / N", span, spread_out=spread_out)
    return Picture(f"Size of the residual over {x.split(' / ')[0]}", plot, f"Shaded: {stretch(where)}.")


def finding_pictures(d: Diagnosis, runs: Sequence[Run]) -> Iterator[Picture]:
    """Measured signature against that of the named physics, one for each finding."""
    for finding in d.findings:
        picture = _signature(finding, runs, driver_quantity(d), several=len(d.model_terms) > 1)
        if picture is not None:
            yield picture


def _signature(finding: Finding, runs: Sequence[Run], driver: str, *, several: bool) -> Picture | None:
    found = signature(runs, finding)
    if found is None:
        return None
    name = effect_name(finding.effect)
    label = name if found.alone or not several else "all findings together"
    what = "what the model lacks without it" if several and found.alone else "what the baseline lacks"
    caption = f"{words(finding.statement)} Points: {what}, with 95 % intervals; line: the model in the same bins."
    plot = _signature_plot(found, label, driver)
    return Picture(f"{name[0].upper()}{name[1:]}", plot, f"{caption} {words(evidence(finding))}.")


def _signature_plot(found: Signature, label: str, driver: str) -> Plot:
    y, factor = KINDS[found.kind]
    told = told_rows(found.measured, found.std)
    at = found.at[told]
    measured = Group("measured", at, factor * found.measured[told], 1.96 * factor * found.std[told])
    model = Curve(label, at, factor * found.modelled[told])
    spread_out = found.quantity in SPREAD_OUT
    return signature_over(measured, model, axis(found.quantity, driver), y, spread_out=spread_out)


def shape_pictures(d: Diagnosis, runs: Sequence[Run]) -> Iterator[Picture]:
    """What the baseline lacks over each coordinate that it fails over, and how much of it the model has."""
    driver = driver_quantity(d)
    for where in (mismatch.where for mismatch in d.mismatch):
        found = shape_of(runs, "driver" if where.quantity == driver else where.quantity)
        if found is not None and np.abs(found.measured).max() > MOST_SHARE:
            found = shape_of(runs, found.quantity, "force")
        if found is not None and found.at.size > 3:
            x = axis(found.quantity, driver).split(" / ")[0]
            plot = _signature_plot(found, "model" if d.model_terms else "baseline", driver)
            caption = (
                "Points: what the baseline lacks, with 95 % intervals; line: what the model adds in the same bins."
            )
            yield Picture(f"Left out over {x}", plot, caption)


def unexplained_picture(u: Remainder, driver: str) -> Picture | None:
    """Shape of what is left."""
    rows = np.array(u.shape).reshape(-1, 3)[u.told]
    if len(rows) < 2:
        return None
    at, mean, std = rows.T
    x = axis(u.where.quantity, driver)
    span = (u.where.low, u.where.high) if u.where.low < u.where.high else None
    plot = shape([Group("left by the model", at, mean, 1.96 * std)], x, "residual / N", span)
    caption = f"Shaded: {stretch(u.where)}, where most of it lies. Bars are 95 % intervals of the mean."
    caption += not_drawn(len(u.shape) - len(rows))
    return Picture(f"What is left over {x.split(' / ')[0]}", plot, caption)


def before_after_pictures(d: Diagnosis) -> Iterator[Picture]:
    """Prediction over measurement and the residual, run by run."""
    shown = largest(d.curves, MOST_PANELS)
    driver = axis("driver", driver_quantity(d))
    for run in shown:
        levels = _is_levels(run)
        order = np.argsort(run.driver, kind="stable") if levels else np.arange(run.time.size)
        over = (run.driver if levels else run.time)[order]
        panel = Panel(run.recording_id, over, run.thrust[order], run.baseline[order], run.model[order])
        caption = "Before: the baseline; after: the model with what was found. RMSE per interval, not per sample."
        if len(d.curves) > MOST_PANELS:
            caption += f" {MOST_PANELS} of {len(d.curves)} runs are shown."
        plot = before_after(panel, "thrust / N", driver if levels else "time / s")
        yield Picture(f"Prediction and residual{_of(run, d)}", plot, caption)


def next_picture(n: NextExperiment) -> Picture:
    """The sweep over time."""
    rows = [(s.duration, s.command_voltage, s.flow_speed) for s in n.steps]
    durations, levels, flow = zip(*rows, strict=True)
    plot = steps_plot(durations, levels, flow, "voltage" if n.unit == "V" else "rotation rate", n.unit)
    return Picture("The next sweep", plot, "Each level is held; expected power is that of telling the rivals apart.")
