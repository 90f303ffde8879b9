"""Fit of thrust to recordings larger than memory: every file is read once, in blocks; memory does not grow with them.

The rows are samples, not points of holds. Of marked holds the second half is used (`load` and a fit in memory leave
out at most the first); of a run without them every sample. The standard errors come from the scatter of batches of
rows (`identification.estimation.batches`), so that noise correlated over many samples is paid for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from identification.estimation.batches import BatchSums, Sandwich, sandwich
from identification.estimation.regression import LinearFit
from identification.estimation.streaming import Block, Condensed, condense, join, solve
from identification.estimation.tails import student_quantile
from identification.recording import Channel, Floats, Recording
from identification.steady_state.holds import Window, from_steps, overlap_free, without_waiting
from identification.steady_state.points import FALLBACK
from identification.steady_state.settling import LONGEST_CUT
from identification.thruster.thrust import Parameter
from identification.thruster.thrust_data import gain_std, voltage_at
from identification.thruster.thrust_forms import FORMS, Form, Model
from rig.errors import RecordingError
from rig.hdf5 import load
from rig.hdf5.apart import apart, open_no_more
from rig.hdf5.blocks import LongChannel, long_channels
from rig.hdf5.voided import void_spans

LONG = 200_000
"""Thrust samples in all files above which `rig fit` goes by one pass on its own accord: 200 s at 1 kHz. A fit of a sine
in memory takes 16 KB and 0.17 ms per sample (measured on 25,000 and 50,000), so 3 GB there."""
PLACES = 32
"""Places, evenly over a recording, from which the sample that starts the regression is taken."""
ROWS_AT_PLACE = 256


@dataclass(eq=False)
class Pass:
    """One recording on its way through: what is known before, and what gathers."""

    path: Path
    recording: Recording
    """Without rows."""
    thrust: Channel
    source: Channel
    windows: tuple[Window, ...]
    rows: Condensed | None = None
    sums: BatchSums | None = None
    skipped: int = 0
    first: float = field(default=float("inf"))
    last: float = field(default=float("-inf"))
    """s, of the samples used."""


@dataclass(frozen=True, eq=False)
class OnePass:
    """A thrust fit of all samples of one thruster."""

    thruster: str
    form: Form
    passes: tuple[Pass, ...]
    parameters: dict[str, Parameter]
    tare: dict[str, Parameter]
    fit: LinearFit
    spread: Sandwich
    rows: int

    @property
    def rmse(self) -> float:
        """N, of the samples used."""
        return float(np.sqrt(max(self.fit.sigma2 or 0.0, 0.0) * max(self.fit.dof, 0) / self.rows))


def thrust_rows(paths: Sequence[Path]) -> int:
    """Thrust samples in all recordings together; those without thrust count none."""
    total = 0
    for path in paths:
        thrust = load(path, rows=0).first_of("thrust")
        if thrust is not None:
            total += apart(partial(_row_count, path, thrust), path)
    return total


def _row_count(path: Path, channel: Channel) -> int:
    with long_channels(path, channel) as (found,):
        return found.rows


def fit_one_pass(paths: Sequence[Path], model: Model = "C V|V|", against: str = FALLBACK[0]) -> tuple[OnePass, ...]:
    """One fit per thruster, in order of first appearance. Raises RecordingError for what cannot be used."""
    groups: dict[str, list[Pass]] = {}
    seen: dict[str, Path] = {}
    for path in paths:
        run = _prepared(path, against)
        other = seen.setdefault(run.recording.recording_id, path)
        if other != path:
            raise RecordingError(f"{path} is the same recording as {other}; give it once")
        groups.setdefault(run.recording.thruster, []).append(run)
    return tuple(_fit(thruster, runs, model) for thruster, runs in groups.items())


def _prepared(path: Path, against: str) -> Pass:
    recording = load(path, rows=0)
    if recording.kind == "vehicle":
        raise RecordingError(f"{path} is a vehicle trial; `rig fit` takes tunnel or bollard runs of one thruster")
    thrust = recording.first_of("thrust")
    if thrust is None:
        raise RecordingError(
            f"{path} has no channel of quantity thrust; without a measured force nothing can be fitted"
        )
    wanted = FALLBACK if against == FALLBACK[0] else (against,)
    for quantity in wanted:
        found = recording.first_of(quantity)
        if found is not None and _has_numbers(path, found):
            marked = without_waiting(from_steps(recording))
            holds = len({w.voltage for w in marked}) > 1 and overlap_free(marked)
            return Pass(path, recording, thrust, found, marked if holds else ())
    raise RecordingError(f"{path} has no {' nor '.join(wanted)} channel with numbers in it; give one with --against")


def _has_numbers(path: Path, channel: Channel) -> bool:
    def looked() -> bool:
        with long_channels(path, channel) as (found,):
            open_no_more()
            return any(bool(np.any(np.isfinite(value))) for _, value in found.blocks())

    return apart(looked, path)


def _rows(run: Pass, form: Form, time: Floats, thrust: Floats, source: Channel) -> tuple[Floats, Floats, int]:
    """H (k, c + 1) with a last column of ones, thrust (k,), and how many samples of the windows could not be used."""
    voltage = voltage_at(source, time)
    inside = _inside(run.windows, void_spans(run.recording.steps), time)
    good = inside & np.isfinite(thrust) & np.isfinite(voltage)
    V = voltage[good]
    H = np.empty((V.size, len(form.coefficients) + 1))
    H[:, 0] = V * np.abs(V)
    if form.split:
        H[:, 1] = np.minimum(H[:, 0], 0.0)
        H[:, 0] = np.maximum(H[:, 0], 0.0)
    H[:, -1] = 1.0
    return H, thrust[good], int(np.count_nonzero(inside)) - V.size


def _inside(
    windows: Sequence[Window], void: Sequence[tuple[float, float]], time: Floats
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Samples in the second half of a hold, all of them when there are no holds; none that is `void`."""
    inside = np.full(time.size, not windows, dtype=np.bool_)
    for window in windows:
        settled = window.t_start + LONGEST_CUT * (window.t_end - window.t_start)
        low, high = np.searchsorted(time, (settled, window.t_end))
        inside[low:high] = True
    for span in void:
        low, high = np.searchsorted(time, span)
        inside[low:high] = False
    return inside


def _blocks(run: Pass, form: Form, thrust: LongChannel, source: LongChannel) -> Iterator[Block]:
    """The one pass: what comes out has gone into the batches as well."""
    assert run.sums is not None
    start = 0
    for time, value in thrust.blocks():
        known = time[np.isfinite(time)]
        if known.size == 0:
            run.skipped += time.size
            continue
        around, start = source.around(float(known[0]), float(known[-1]), start)
        H, y, skipped = _rows(run, form, time, value, around)
        run.skipped += skipped
        if y.size:
            run.first, run.last = min(run.first, float(known[0])), max(run.last, float(known[-1]))
            run.sums.add(H, y)
            yield H, y


def _sample(run: Pass, form: Form, thrust: LongChannel, source: LongChannel) -> Block:
    """A few rows from all over the recording."""
    count = min(ROWS_AT_PLACE, thrust.rows)
    parts = []
    places = min(PLACES, thrust.rows // max(count, 1))  # no row twice: a sample is of rows that the blocks have
    for start in np.linspace(0, thrust.rows - count, places).astype(int).tolist():
        time, found = thrust.times(start, start + count)
        value = np.where(time == found, thrust.values(start, start + count), np.nan)
        known = time[np.isfinite(time)]
        if known.size:
            hint = max(source.place(float(known[0])) - 2, 0)
            parts.append(_rows(run, form, time, value, source.around(float(known[0]), float(known[-1]), hint)[0]))
    empty = np.empty((0, len(form.coefficients) + 1))
    return np.vstack([empty, *(H for H, _, _ in parts)]), np.concatenate([np.empty(0), *(y for _, y, _ in parts)])


def _gathered(run: Pass, form: Form) -> Pass:
    """The run with what one reading of its file gives."""
    with long_channels(run.path, run.thrust, run.source) as (thrust, source):
        open_no_more()
        H, y = _sample(run, form, thrust, source)
        run.sums = BatchSums(np.asarray(np.linalg.lstsq(H, y, rcond=None)[0], dtype=np.float64))
        run.rows = condense(_blocks(run, form, thrust, source), H.shape[1], (H, y) if y.size else None)
    return run


def _fit(thruster: str, runs: Sequence[Pass], model: Model) -> OnePass:
    kinds = {run.source.quantity for run in runs}
    if "rotation_rate" in kinds and len(kinds) > 1:
        raise RecordingError(
            f"recordings of {thruster}: some have a voltage, some only a rotation rate; fit them apart"
        )
    form = FORMS[model, "rotation_rate" in kinds]
    if form.with_flow:
        raise RecordingError(f"{form.name}: the flow term is not fitted in one pass; expected C V|V| or C+/C-")
    runs = [apart(partial(_gathered, run, form), run.path) for run in runs]
    for run in runs:
        if run.rows is None or run.rows.rows == 0:
            raise RecordingError(f"{run.path} has no thrust sample at a known {run.source.quantity}")
    count = len(form.coefficients)
    places = [(*range(count), count + k) for k in range(len(runs))]
    names = (*form.coefficients, *(f"tare[{run.recording.recording_id}]" for run in runs))
    rows = [run.rows for run in runs if run.rows is not None]
    together = join(list(zip(rows, places, strict=True)), len(names))
    return _answer(thruster, form, runs, names, together, places)


def _answer(
    thruster: str,
    form: Form,
    runs: Sequence[Pass],
    names: tuple[str, ...],
    together: Condensed,
    places: Sequence[tuple[int, ...]],
) -> OnePass:
    fit = solve(together, names)
    files = ", ".join(run.path.name for run in runs)
    if fit.deficiency is not None:
        raise RecordingError(f"{files}: {fit.deficiency.statement}; drive at least two levels, for C+/C- both ways")
    p = len(names)
    series = [(run.sums, place) for run, place in zip(runs, places, strict=True) if run.sums is not None]
    try:
        spread = sandwich(together.triangle[:p, :p], fit.theta, series)
    except ValueError as error:
        raise RecordingError(f"{files}: too few samples for a fit in one pass: {error}") from error
    gain = max(gain_std(run.thrust) for run in runs)
    found = [_parameter(fit, spread, i, form.units[i], gain) for i in range(len(form.coefficients))]
    tares = [_parameter(fit, spread, p - len(runs) + k, "N", gain_std(run.thrust)) for k, run in enumerate(runs)]
    parameters = dict(zip(form.coefficients, found, strict=True))
    tare = {run.recording.recording_id: value for run, value in zip(runs, tares, strict=True)}
    return OnePass(thruster, form, tuple(runs), parameters, tare, fit, spread, together.rows)


def _parameter(fit: LinearFit, spread: Sandwich, i: int, unit: str, gain: float) -> Parameter:
    value, scatter = float(fit.theta[i]), float(np.sqrt(spread.cov[i, i]))
    calibration = abs(value) * gain
    std, dof = float(np.hypot(scatter, calibration)), float(spread.dof[i])
    if scatter > 0:
        dof *= (std / scatter) ** 4  # Welch-Satterthwaite: the calibration has infinite dof
    half = float(student_quantile(0.975, dof)) * std
    alone = float(fit.std[i])
    return Parameter(value, std, unit, scatter, calibration, alone, dof, value - half, value + half)
