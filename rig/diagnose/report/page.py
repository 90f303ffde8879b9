"""The report of `rig diagnose`: where the model fails, what was left out, how much better it is, what to do next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

from identification.mismatch.compare.reported_runs import Run, runs_of
from identification.mismatch.diagnosis import Diagnosis, NextExperiment
from identification.mismatch.value import Value
from identification.mismatch.verdict_clauses import NOT_WHITE, beyond_noise
from identification.recording import Recording
from rig.diagnose.by_calibration import by_calibration
from rig.diagnose.recording_names import NO_NAMES, told_by_name
from rig.diagnose.report.flexible import flexible_pictures, modelled_remarks
from rig.diagnose.report.pictures import (
    before_after_pictures,
    finding_pictures,
    next_picture,
    shape_pictures,
    unexplained_picture,
    where_pictures,
)
from rig.diagnose.report.rivals import told_apart
from rig.diagnose.report.words import driver_quantity, effect_name, evidence, rarity, value_cells, words
from rig.diagnose.text import baseline_name
from rig.diagnose.typed import TITLE, typed
from rig.report import page as pages
from rig.report import provenance
from rig.report.page import Listing, Page, Remark, Section, Sentences, Table, columns, sentences

LISTED = 80
"""Columns of the equations."""
MOST_ROWS = 12
"""Rows of a table of steps that stays open."""
PREDICTS_BETTER = "With slow noise taken out the model predicts them better"
VERDICTS: Mapping[str, Remark] = {
    "adequate": Remark("Adequate: no mismatch at the stated false-alarm rate.", "good"),
    "explained": Remark("Explained: the findings account for the mismatch.", "good"),
    "ambiguous": Remark("Ambiguous: several effects explain these recordings about as well; see the rivals.", "doubt"),
    "unexplained": Remark("Unexplained: structure is left that nothing in the catalogue carries.", "bad"),
}
UNPREDICTIVE = Remark("Unexplained: what was found does not predict data that were not fitted.", "bad")


def write(
    diagnosis: Diagnosis, path: Path, recordings: Sequence[Recording] = (), names: Mapping[str, str] = NO_NAMES
) -> None:
    """One page. `recordings`: those diagnosed; with them each effect is drawn by itself, over all that was recorded.

    `names`: of the recordings' files, by recording id: they stand in the place of the ids. Raises OSError.
    """
    pages.write(diagnosis_page(diagnosis, recordings, names), path)


def diagnosis_page(
    diagnosis: Diagnosis, recordings: Sequence[Recording] = (), names: Mapping[str, str] = NO_NAMES
) -> Page:
    """The page of one diagnosis."""
    d = told_by_name(diagnosis, names)
    runs = runs_of(d, [replace(r, recording_id=names.get(r.recording_id, r.recording_id)) for r in recordings])
    sections = (
        Section("In short", sentences(short(d))),
        where_section(d, runs),
        *what_section(d, runs),
        *unexplained_section(d, runs),
        after_section(d),
        parameter_section(d),
        *rivals_section(d),
        *next_section(d.next_experiment),
        *notes_section(d),
        provenance_section(diagnosis, names),
    )
    return Page(f"Diagnosis of {d.thruster or 'a thruster'}: {d.headline}", words(d.statement), sections, contents=True)


def short(d: Diagnosis) -> Iterator[Remark]:
    """Verdict, error on what was not fitted, what next."""
    yield _verdict(d)
    held = d.heldout
    if isfinite(held.before) and isfinite(held.after):
        better = "" if held.after >= held.before else f", {_change(held.before, held.after)} less"
        noise = f"; the noise alone is {held.noise:.3g} {d.unit}" if isfinite(held.noise) else ""
        tone: pages.Tone = "good" if held.after <= held.before else "bad"
        change = f"from {held.before:.3g} to {held.after:.3g} {d.unit}"
        if better and d.nameless:
            better += f" with {d.nameless}"
        text = f"On data that were not fitted the error goes {change}{better}{noise}."
        if held.hidden:
            yield Remark(f"{text} Slow noise makes most of that error. {PREDICTS_BETTER}.")
        else:
            yield Remark(text, tone if d.model_terms else "")
    if d.next_experiment is not None:
        total = sum(step.duration for step in d.next_experiment.steps)
        sweep = f"a sweep of {total:.0f} s, expected power {d.next_experiment.expected_power:.2f}"
        first = _clauses(d.next_experiment.why)[0]
        yield Remark(f"Next: {sweep if d.next_experiment.steps else 'no sweep settles it'}. {first}")


def _verdict(d: Diagnosis) -> Remark:
    if d.unexplained is not None and d.unexplained.unpredictive:
        return UNPREDICTIVE
    if d.headline == d.verdict:
        return VERDICTS[d.verdict]
    return Remark(f"{d.headline[:1].upper()}{d.headline[1:]}; what is left nothing in the catalogue carries.", "doubt")


def _clauses(text: str) -> list[str]:
    """A reason as sentences.

    >>> _clauses("separates a from b; no sweep is likely to tell c")
    ['Separates a from b.', 'No sweep is likely to tell c.']
    """
    parts = [part.strip() for part in words(text).removesuffix(".").split(";")]
    return [f"{part[:1].upper()}{part[1:]}." for part in parts if part] or ["No reason was given."]


def _change(before: float, after: float) -> str:
    """How much smaller, in per cent."""
    if before <= 0:
        return "–"
    share = 100 * (1 - after / before)
    return (f"{share:.0f} %" if abs(share) >= 10 else f"{share:.2g} %").replace("-", "−")


def where_section(d: Diagnosis, runs: Sequence[Run]) -> Section:
    """Where the baseline fails."""
    told = [words(f"{m.statement.removesuffix('.')} ({rarity(m.p_value)}).") for m in d.mismatch]
    if not told:
        told = [f"Nowhere: nothing that was recorded orders the residual of {baseline_name(d)}."]
    return Section(f"Where {baseline_name(d)} fails", (*sentences(told), *where_pictures(d, runs)))


def what_section(d: Diagnosis, runs: Sequence[Run]) -> tuple[Section, ...]:
    """What was left out; nothing where nothing was found."""
    if not d.findings:
        return ()
    lead = "Measured signature against the signature of the named physics, over the coordinate that shows it best."
    drawn = tuple(finding_pictures(d, runs))
    titles = {picture.title.lower() for picture in drawn}
    told = [words(f"{f.statement} {evidence(f)}.") for f in d.findings if effect_name(f.effect).lower() not in titles]
    return (Section("What was left out", (*sentences(told), *drawn), lead),)


def unexplained_section(d: Diagnosis, runs: Sequence[Run]) -> tuple[Section, ...]:
    """What is left: where, its shape, what it resembles, and the shapes over all that the baseline fails over."""
    u = d.unexplained
    if u is None:
        return ()
    of = "what the baseline leaves" if u.unpredictive else "what remains"
    left = f"{100 * u.share:.0f} % of {of} is structure, not noise ({rarity(u.p_value)})."
    told = [Remark(left, "bad")]
    told += [Remark(words(f"Resembles {text.removesuffix('.')}."), "doubt") for text in u.resembles]
    told += modelled_remarks(u)
    picture = unexplained_picture(u, driver_quantity(d))
    drawn = (*(() if picture is None else (picture,)), *flexible_pictures(u, driver_quantity(d)))
    drawn = (*drawn, *shape_pictures(d, runs))
    return (Section("What is not explained", (*sentences(told), *drawn)),)


def after_section(d: Diagnosis) -> Section:
    """How much better it is."""
    return Section("Before and after", (*after_table(d), *before_after_pictures(d)))


def after_table(d: Diagnosis) -> tuple[Table, Sentences]:
    """Errors before and after, in the unit of what is explained."""
    head = ("RMSE per sample", *(f"{name} / {d.unit}" for name in ("before", "after", "noise")), "smaller by")
    held, known = d.heldout, isfinite(d.heldout.noise)
    listed = [
        ("fitted", d.train.before, d.train.after, ""),
        ("not fitted", held.before, held.after, f"{held.noise:.4g}" if known else "–"),
    ]
    rows: list[tuple[str, ...]] = [(name, f"{a:.4g}", f"{b:.4g}", floor, _change(a, b)) for name, a, b, floor in listed]
    if known and max(held.before, held.after) > held.noise and not held.hidden:
        own = [beyond_noise(x, held.noise) for x in (held.before, held.after)]
        told = ["within noise" if x == 0 else f"{x:.3g}" for x in own]
        rows.append(("not fitted, noise taken out", *told, "", _change(*own) if own[1] > 0 else ""))
    white = "white" if d.white else "not white"
    meaning = "" if d.white else f": {NOT_WHITE}"
    judged = (
        Remark(words(f"Not fitted: {d.heldout.what}.")),
        *(
            (Remark(f"{PREDICTS_BETTER}: χ² falls there by {held.whitened_fall:.3g} more than its price."),)
            if held.hidden
            else ()
        ),
        Remark(f"χ² per degree of freedom of the weighted residual: {d.chi2_per_dof:.3f}."),
        Remark(
            f"What remains is {white} ({rarity(d.whiteness_p)}){meaning}.",
            "good" if d.white else "doubt",
        ),
    )
    table = Table("Baseline and model", head, tuple(rows), columns(head, head[0]))
    return table, Sentences(judged)


def parameter_section(d: Diagnosis) -> Section:
    """Every number of the model that is a physics'; a shape without a name is drawn."""
    head = ("parameter", "of", "value ± std", "95 % interval", "unit", "baseline had")
    findings = {f.effect for f in d.findings}
    physics = {name: value for name, value in d.model.items() if not name.startswith("flexible:")}  # these are drawn
    rows = tuple(_parameter_row(name, value, d.baseline.get(name), findings) for name, value in physics.items())
    table = Table("Model with its standard errors", head, rows, columns(head, "parameter", "of", "unit"))
    terms = " + ".join([baseline_name(d), *map(effect_name, d.model_terms)])
    listed = (Listing(TITLE, tuple(typed(d.equations, LISTED))),) if d.equations else ()
    return Section("Parameters", (table, *listed), words(f"Model: {terms}{by_calibration(d)}."))


def _parameter_row(name: str, value: Value, before: Value | None, findings: set[str]) -> tuple[str, ...]:
    effect, dot, parameter = (name, "", "") if "[" in name else name.partition(".")  # tare[T1.h5] has a dot of its own
    named = not dot or effect.split("#")[0] in findings
    doubted = "" if named else " (name not earned)"
    shown = (parameter if dot else name).replace("_", " ")
    of = effect_name(effect) + doubted if dot else "baseline"
    return (shown, of, *value_cells(value), "" if before is None else value_cells(before)[0])


def rivals_section(d: Diagnosis) -> tuple[Section, ...]:
    """What explains it about as well."""
    head = ("rival", "instead of", "BIC loss", "odds against", "what it would be", "what tells them apart")
    rows = tuple(
        (
            effect_name(rival.effect, rival.form),
            effect_name(f.effect, f.form),
            f"{round(rival.bic_loss, 1) + 0.0:.1f}".replace("-", "−"),
            _odds(rival.bic_loss),
            words(rival.statement),
            told_apart(f.effect, rival.effect, f.form, rival.form) or "–",
        )
        for f in d.findings
        for rival in f.rivals
    )
    if not rows:
        return ()
    table = Table(
        "Effects in the place of a finding, everything fitted anew", head, rows, columns(head, *head[:2], *head[4:])
    )
    lead = "A loss below about 6 is no evidence; above 10 the rival is out of the question as far as BIC goes."
    return (Section("Rivals", (table,), lead),)


def _odds(loss: float) -> str:
    """exp(loss / 2), the odds that a difference in BIC stands for.

    >>> _odds(2.0), _odds(20.0), _odds(-2.0)
    ('2.7 : 1', '22026 : 1', '1 : 2.7')
    """
    if abs(loss) < 0.1:
        return "1 : 1"
    if abs(loss) > 27:
        return "over 10⁶ : 1" if loss > 0 else "1 : over 10⁶"
    odds = 2.718281828459045 ** (0.5 * abs(loss))
    shown = f"{odds:.1f}" if odds < 100 else f"{odds:.0f}"
    return f"{shown} : 1" if loss >= 0 else f"1 : {shown}"


def next_section(n: NextExperiment | None) -> tuple[Section, ...]:
    """The sweep that decides."""
    if n is None or not n.steps:
        return ()
    head = ("step", "voltage / V" if n.unit == "V" else "rotation rate / (rev/s)", "duration / s", "flow / (m/s)")
    rows = tuple(
        (str(i), f"{s.command_voltage:+.4g}".replace("-", "−"), f"{s.duration:.4g}", f"{s.flow_speed:.3g}")
        for i, s in enumerate(n.steps, 1)
    )
    table = Table(f"{len(rows)} steps", head, rows, frozenset(), folded=len(rows) > MOST_ROWS)
    total = sum(s.duration for s in n.steps)
    told = (*_clauses(n.why), f"It takes {total:.0f} s; expected power {n.expected_power:.2f}.")
    return (Section("The next experiment", (*sentences(told), next_picture(n), table)),)


def notes_section(d: Diagnosis) -> tuple[Section, ...]:
    """The notes of a diagnosis as one section, or none where nothing was noted."""
    return (Section("Notes", sentences(map(words, d.notes))),) if d.notes else ()


def provenance_section(d: Diagnosis, names: Mapping[str, str] = NO_NAMES) -> Section:
    """Recordings by id, with the names and the hashes of their files where they are known."""
    known = {s.recording_id: s.sha256 for s in d.twin.sources} if d.twin is not None else {}
    if not names and not any(known.get(name) for name in d.recordings):
        return provenance.section((), d.recordings)
    told = [("recording id", {name: name for name in d.recordings}), ("SHA-256 of the file", known)]
    if names:
        told.insert(0, ("file", dict(names)))
    head = tuple(title for title, _ in told)
    rows = tuple(tuple(cells.get(name, "") or "–" for _, cells in told) for name in d.recordings)
    table = Table("Recordings behind this page", head, rows, columns(head, *head))
    return Section("Provenance", (table,), f"Computed by {pages.program()}.")
