"""What `rig fit` finds: per thruster the model asked for, the others beside it, and what each residual says."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from identification.estimation.least_squares import Method
from identification.recording import Recording
from identification.steady_state.command_skew import command_skew
from identification.thruster.dynamics import DynamicsFit, fit_dynamics
from identification.thruster.model_choice import Candidate, Remainder, side_by_side, without
from identification.thruster.thrust import ThrustFit, fit_runs
from identification.thruster.thrust_data import Run, Unusable, prepare
from identification.thruster.thrust_forms import FORMS, MODELS, Model
from rig.errors import RecordingError
from rig.hdf5 import load
from rig.hdf5.layout import FLUSH_PERIOD

FIT_FORMAT = "thruster-rig-fit"
FIT_VERSION = 1
OTHER_AXIS = {"command_voltage": "rotation_rate", "motor_voltage": "rotation_rate", "rotation_rate": "command_voltage"}
"""What the thrust is explained by in the models beside the chosen one, where it was recorded too."""


@dataclass(frozen=True, eq=False)
class Answer:
    """Of one thruster: the fit asked for and the other models beside it, where the data allow them."""

    fit: ThrustFit
    alternatives: tuple[ThrustFit, ...]
    notes: tuple[str, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    """The fit and its alternatives, in their order, with what each residual says."""
    remainders: tuple[Remainder, ...] = ()
    """The fit without each of its coefficients in turn."""
    dynamics: DynamicsFit | Unusable | None = None
    """Of the rotor; the sentence why there is none; None when it was not asked for."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is to be fitted. `dynamics`: the rotor too."""

    model: Model = "C V|V|"
    voltage: str = "command_voltage"
    method: Method = "wls"
    dynamics: bool = False


def fit_recordings(
    recordings: Sequence[Recording],
    model: Model = "C V|V|",
    voltage: str = "command_voltage",
    method: Method = "wls",
    *,
    dynamics: bool = False,
) -> tuple[Answer, ...]:
    """One answer per thruster, in order of first appearance. Raises RecordingError for input that cannot be used."""
    wanted = Wanted(model, voltage, method, dynamics)
    seen: dict[str, str] = {}
    groups: dict[str, list[Recording]] = {}
    for recording in recordings:
        name = recording.source or recording.recording_id
        if recording.recording_id in seen:
            other = seen[recording.recording_id]
            raise RecordingError(f"{name} is the same recording as {other} ({recording.recording_id}); give it once")
        seen[recording.recording_id] = name
        groups.setdefault(recording.thruster, []).append(recording)
    prepared = {thruster: _prepared(group, voltage) for thruster, group in groups.items()}
    return tuple(_answer(groups[thruster], runs, wanted) for thruster, runs in prepared.items())


def _prepared(recordings: Sequence[Recording], voltage: str) -> list[Run]:
    runs = []
    for recording in recordings:
        run = prepare(recording, voltage)
        if isinstance(run, Unusable):
            raise RecordingError(run.reason)
        runs.append(run)
    return runs


def _answer(recordings: Sequence[Recording], runs: Sequence[Run], wanted: Wanted) -> Answer:
    fit = fit_runs(runs, wanted.model, wanted.method)
    if isinstance(fit, Unusable):
        raise RecordingError("; ".join([fit.reason, *_out_of_order(recordings)]))
    notes = tuple(
        f"{recording.source or recording.recording_id} was {recording.outcome}: what it holds was used"
        for recording in recordings
        if recording.outcome in {"aborted", "tripped"}
    )
    notes = (*unclosed(recordings), *_out_of_order(recordings), *_skewed(recordings), *notes, *_whose_tares(recordings))
    others = tuple(_beside(recordings, runs, wanted))
    dynamics = fit_dynamics(recordings) if wanted.dynamics else None
    remainders = tuple(without(fit, name) for name in fit.parameters)
    return Answer(fit, others, notes, side_by_side((fit, *others)), remainders, dynamics)


def unclosed(recordings: Iterable[Recording]) -> list[str]:
    """What is to be known of recordings whose writer was killed or is at work."""
    names = [r.source or r.recording_id for r in recordings if r.attributes.get("opened_as") == "swmr"]
    return [
        f"{name} was not closed in order, or is still being written: what it holds was used, what came in the last "
        f"{2 * FLUSH_PERIOD:g} s may be lost; rig recover {name} makes a plain copy and counts the loss"
        for name in names
    ]


def _out_of_order(recordings: Sequence[Recording]) -> list[str]:
    """What the reader had to leave out since its time runs backwards."""
    texts = [event.text for recording in recordings for event in recording.events if event.level == "warning"]
    return [text for text in texts if "running back" in text]


def _whose_tares(recordings: Sequence[Recording]) -> list[str]:
    """The files behind `tare 1`, `tare 2`, where there are several."""
    named = [f"tare {k} is of {r.source or r.recording_id}" for k, r in enumerate(recordings, start=1)]
    return [", ".join(named)] if len(named) > 1 else []


def _skewed(recordings: Sequence[Recording]) -> list[str]:
    """Recordings whose thrust leads or lags its command by a part of a level."""
    found = [(recording, command_skew(recording)) for recording in recordings]
    return [f"{r.source or r.recording_id}: {skew.statement}" for r, skew in found if skew is not None]


def _models(runs: Sequence[Run], but: Model | None = None) -> list[Model]:
    """The sensible ones: with the flow term only where a flow was recorded and moves."""
    flows = all(run.flow is not None and run.flow.moves for run in runs)
    by_rate = runs[0].voltage_quantity == "rotation_rate"
    return [model for model in MODELS if model != but and (flows or not FORMS[model, by_rate].with_flow)]


def _beside(recordings: Sequence[Recording], runs: Sequence[Run], wanted: Wanted) -> Iterable[ThrustFit]:
    """Other models of the same signal, then those of the other signal where all recordings have it."""
    found = [fit_runs(runs, model, wanted.method) for model in _models(runs, wanted.model)]
    other = OTHER_AXIS[runs[0].voltage_quantity]
    turned = [prepare(recording, other) for recording in recordings]
    good = [run for run in turned if isinstance(run, Run) and not run.unsigned]
    if len(good) == len(turned) and all((run.voltage_quantity == "rotation_rate") == _by_rate(other) for run in good):
        found += [fit_runs(good, model, wanted.method) for model in _models(good)]
    return (fit for fit in found if isinstance(fit, ThrustFit))


def _by_rate(quantity: str) -> bool:
    return quantity == "rotation_rate"


def is_driven(recording: Recording) -> bool:
    """False for the end of a run that was cut before its last tare: it holds that tare and nothing to fit."""
    return not recording.steps or any(step.phase in ("hold", "sine", "ramp") for step in recording.steps)


def fit_files(
    paths: Iterable[Path],
    model: Model = "C V|V|",
    voltage: str = "command_voltage",
    method: Method = "wls",
    *,
    dynamics: bool = False,
) -> tuple[Answer, ...]:
    """Load and fit; a folder stands for every `*.h5` in it. Raises RecordingError with one sentence."""
    return fit_recordings([load(path) for path in expand(paths)], model, voltage, method, dynamics=dynamics)


def expand(paths: Iterable[Path]) -> list[Path]:
    """The recordings meant by files and folders. Raises RecordingError."""
    files = list(chain.from_iterable(_expand(Path(path)) for path in paths))
    if not files:
        raise RecordingError("rig fit: no recording was given; expected one or more *.h5 files")
    return files


def _expand(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(path.glob("*.h5"))
    if not found:
        raise RecordingError(f"{path} is a folder without recordings; expected *.h5 files in it")
    return found
