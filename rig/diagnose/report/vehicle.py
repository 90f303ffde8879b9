"""The report of `rig diagnose` for a vehicle: where motion and model part, what was left out, before and after."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from identification.mismatch.diagnosis import Curves, Diagnosis
from identification.mismatch.unexplained import Remainder
from identification.recording import Recording
from rig.diagnose.recording_names import NO_NAMES, told_by_name
from rig.diagnose.report.figures import shape
from rig.diagnose.report.page import (
    after_table,
    next_section,
    notes_section,
    parameter_section,
    provenance_section,
    rivals_section,
    short,
)
from rig.diagnose.report.words import evidence, not_drawn, rarity, stretch, words
from rig.report import page as pages
from rig.report.mismatch_figures import Panel, before_after
from rig.report.page import Page, Picture, Remark, Section, sentences
from rig.report.regression_figures import Group
from rig.report.style import unit_text

MOST_RUNS = 4


def write(
    diagnosis: Diagnosis, path: Path, _recordings: Sequence[Recording] = (), names: Mapping[str, str] = NO_NAMES
) -> None:
    """One page; `names` of the recordings' files, by recording id. Raises OSError."""
    pages.write(vehicle_page(diagnosis, names), path)


def vehicle_page(diagnosis: Diagnosis, names: Mapping[str, str] = NO_NAMES) -> Page:
    """The page of one diagnosis of a vehicle."""
    d = told_by_name(diagnosis, names)
    before = Section("Before and after", (*after_table(d), *motion_pictures(d)))
    sections = (
        Section("In short", sentences(short(d))),
        where_section(d),
        *what_section(d),
        *unexplained_section(d),
        before,
        parameter_section(d),
        *rivals_section(d),
        *next_section(d.next_experiment),
        *notes_section(d),
        provenance_section(diagnosis, names),
    )
    return Page(f"Diagnosis of {d.thruster or 'a vehicle'}: {d.headline}", words(d.statement), sections, contents=True)


def where_section(d: Diagnosis) -> Section:
    """Where the baseline fails, and how large its error is over the command."""
    told = [words(f"{m.statement.removesuffix('.')} ({rarity(m.p_value)}).") for m in d.mismatch]
    if not told:
        told = [f"Nowhere: no force over anything that was recorded improves {d.baseline_model}."]
    return Section(f"Where {d.baseline_model} fails", (*sentences(told), *_over_command(d)))


def _over_command(d: Diagnosis) -> Iterator[Picture]:
    """Residual over the mean command, before and after."""
    if not d.mismatch or not d.curves:
        return
    groups = []
    for name, residual in (("before", _before), ("after", _after)):
        command = np.concatenate([c.driver for c in d.curves])
        groups.append(Group(name, command, np.concatenate([residual(c) for c in d.curves])))
    plot = shape(groups, "mean command / V", f"{d.response}: residual / {unit_text(d.unit)}", None, wide=True)
    caption = f"Every sample. Before: {d.baseline_model}; after: the model with what was found."
    yield Picture("Residual over the command", plot, caption)


def _before(c: Curves) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.asarray(c.thrust - c.baseline)


def _after(c: Curves) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.asarray(c.thrust - c.model)


def what_section(d: Diagnosis) -> tuple[Section, ...]:
    """What was left out; nothing where nothing was found."""
    told = [words(f"{f.statement.removesuffix('.')} ({evidence(f)}).") for f in d.findings]
    return (Section("What was left out", sentences(told)),) if told else ()


def unexplained_section(d: Diagnosis) -> tuple[Section, ...]:
    """The force that is left, over what orders it."""
    u = d.unexplained
    if u is None:
        return ()
    of = "what the baseline leaves" if u.unpredictive else "what remains"
    told = [Remark(f"{100 * u.share:.2g} % of {of} is structure, not noise ({rarity(u.p_value)}).", "bad")]
    told += [Remark(words(f"Resembles {text.removesuffix('.')}."), "doubt") for text in u.resembles]
    return (Section("What is not explained", (*sentences(told), *_left(u, d))),)


def _left(u: Remainder, d: Diagnosis) -> Iterator[Picture]:
    rows = np.array(u.shape).reshape(-1, 3)[u.told]
    if len(rows) < 2:
        return
    at, force, std = rows.T
    unit = "" if u.where.unit in ("", "1") else f" / {unit_text(u.where.unit)}"
    x = u.where.quantity.replace("_", " ") + unit
    span = (u.where.low, u.where.high) if u.where.low < u.where.high else None
    plot = shape([Group("force left out", at, force, 1.96 * std)], x, f"force / {unit_text(d.force_unit)}", span)
    caption = f"Shaded: {stretch(u.where)}, where it is clearest. Bars are 95 % intervals; the mean is taken out."
    caption += not_drawn(len(u.shape) - len(rows))
    yield Picture(f"Force that is left over {u.where.quantity.replace('_', ' ')}", plot, words(caption))


def motion_pictures(d: Diagnosis) -> Iterator[Picture]:
    """Simulated and measured motion, run by run."""
    ordered = sorted(d.curves, key=lambda c: -float(np.sum(_before(c) ** 2)))
    for run in ordered[:MOST_RUNS]:
        panel = Panel(run.recording_id, run.time, run.thrust, run.baseline, run.model)
        plot = before_after(panel, f"{d.response} / {unit_text(d.unit)}", "time / s")
        more = f" {MOST_RUNS} of {len(d.curves)} runs are shown." if len(d.curves) > MOST_RUNS else ""
        caption = f"Simulated from the commands. Before: the baseline; after: the model with what was found.{more}"
        yield Picture(f"Motion and residual: {run.recording_id}", plot, caption)
