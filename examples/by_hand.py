"""What a model made by hand does on the recordings of others, beside `rig diagnose`: same fitted part, same judge.

    python examples/by_hand.py [FOLDER] [--only NAME]

FOLDER as of real_diagnosis.py, whose cases these are. BY_HAND has the model that an engineer would make of each: an
equation, fitted by scipy's least squares with a tare for each run. Both are judged on the samples that the tool keeps
back: other runs (only their tare is fitted), or every fourth level or block of time. Printed: error by hand, error of
the tool, their ratio, the tool's verdict and names.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from real_diagnosis import CASES, HERE, Case, imported
from scipy.optimize import least_squares

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.prepare import stage as prepare
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.validate.held_out import blocks
from identification.recording import Floats, Recording
from identification.run_history.history import History
from rig.diagnose.command import diagnose_files
from rig.hdf5 import load

SMOOTH = 0.05
"""s, running mean of a tachometer's voltage: its noise is 0.02 V and more at 1 kHz."""
STARTS = (0.3, 1.0, 3.0)
"""Times where each fit begins: the best of these fits counts. No parameter of these models can be negative."""


@dataclass(frozen=True, eq=False)
class Samples:
    """One run at the samples of its thrust, (n,) each; a channel that was not recorded is None."""

    time: Floats
    thrust: Floats
    V: Floats | None
    """V, commanded or, where no command was recorded, measured."""
    n: Floats | None
    """rev/s."""
    fitted: NDArray[np.bool_]
    """(n,) false where the run is kept back."""


Law = Callable[[Floats, Samples], Floats]
"""Parameters and a run to N, without the tare."""


def square(x: Floats) -> Floats:
    return x * np.abs(x)


def two_ways(x: Floats, forward: float, reverse: float) -> Floats:
    """C+ x^2 forward, C- x^2 in reverse."""
    return np.where(x < 0, reverse, forward) * square(x)


def beyond(V: Floats, band: float) -> Floats:
    """What of the voltage is outside the dead band."""
    return np.sign(V) * np.maximum(np.abs(V) - band, 0.0)


def back_emf(V: Floats, loss: float) -> Floats:
    """In |V| = e + loss e^2 it is e: what is left to turn the motor when the winding has taken its share."""
    out: Floats = np.sign(V) * 2 * np.abs(V) / (1 + np.sqrt(1 + 4 * loss * np.abs(V)))
    return out


def lagging(x: Floats, time: Floats, tau: float) -> Floats:
    """First order: y' = (x - y) / tau, from rest at the first value."""
    keep = np.exp(-np.diff(time, prepend=time[0]) / max(tau, 1e-4))
    out, y = np.empty_like(x), float(x[0])
    for i in range(x.size):
        y = x[i] + (y - x[i]) * keep[i]
        out[i] = y
    return out


def inflow(x: Floats, time: Floats, share: float, tau: float) -> Floats:
    """Thrust overshoots by `share` until the water has followed."""
    return (1 + share) * x - share * lagging(x, time, tau)


def mean_rate(run: Samples) -> Floats:
    assert run.n is not None
    many = max(round(SMOOTH / float(np.median(np.diff(run.time)))), 1) | 1
    return np.convolve(np.pad(run.n, many // 2, mode="edge"), np.full(many, 1 / many), "valid")


def volts(run: Samples) -> Floats:
    assert run.V is not None
    return run.V


def power(V: Floats, q: float) -> Floats:
    return np.sign(V) * np.abs(V) ** q


def late_rate(p: Floats, run: Samples) -> Floats:
    assert run.n is not None
    out: Floats = p[0] * square(np.interp(run.time - p[1], run.time, run.n))
    return out


TANK: tuple[str, Law, tuple[float, ...]] = (
    "C+ C- n|n|, inflow",
    lambda p, r: inflow(two_ways(mean_rate(r), p[0], p[1]), r.time, p[2], p[3]),
    (0.025, 0.025, 0.4, 0.4),
)
ONE_WAY: tuple[str, Law, tuple[float, ...]] = (
    "C n|n|, inflow",
    lambda p, r: inflow(p[0] * square(mean_rate(r)), r.time, p[1], p[2]),
    (0.03, 0.4, 0.4),
)
EFFORT: tuple[str, Law, tuple[float, ...]] = (
    "C+ C- |V|^q, dead band",
    lambda p, r: np.where(volts(r) < 0, p[1], p[0]) * power(beyond(volts(r), p[3]), p[2]),
    (90.0, 80.0, 1.0, 0.03),
)
BY_HAND: dict[str, tuple[str, Law, tuple[float, ...]]] = {
    "tank static": (
        "C+ C- V|V|, dead band",
        lambda p, r: two_ways(beyond(volts(r), p[2]), p[0], p[1]),
        (2.0, 2.0, 0.5),
    ),
    "tank forward-reverse": TANK,
    "tank +2 V": ONE_WAY,
    "tank -2 V": ONE_WAY,
    "stand, voltage sine": ("C+ C- V|V|", lambda p, r: two_ways(volts(r), p[0], p[1]), (0.02, 0.02)),
    "supply sag": ("C n|n| some ms later", late_rate, (3e-6, 0.1)),
    "M5 static": EFFORT,
    "M5 static, other propeller": EFFORT,
    "T200 at 18 V": (
        "C+ C- of the back-EMF, dead band",
        lambda p, r: two_ways(back_emf(beyond(volts(r), p[3]), p[2]), p[0], p[1]),
        (0.3, 0.25, 0.02, 0.2),
    ),
}
"""Name of the case: model in words, its law, where the fit begins (also the sizes of its parameters)."""


def samples(recording: Recording, history: History, *, whole: bool) -> Samples:
    """At the samples that the tool takes; `whole`: none of them is kept back."""
    time = history.sample_time

    def at(*quantities: str) -> Floats | None:
        channel = next((c for q in quantities if (c := recording.first_of(q)) is not None), None)
        if channel is None:
            return None
        if channel.quantity == "command_voltage":
            return channel.held_at(time)
        good = np.isfinite(channel.value)
        return np.interp(time, channel.time[good], channel.value[good])

    fitted = np.zeros(history.edges.size - 1, dtype=bool)
    fitted[history.rows] = True if whole else blocks(history)
    of = fitted[np.searchsorted(history.edges, time, side="right") - 1]
    return Samples(time, history.sample_thrust, at("command_voltage", "motor_voltage"), at("rotation_rate"), of)


def error(case: str, fitted: Sequence[Samples], judged: Sequence[Samples]) -> tuple[float, Floats]:
    """N, root mean square on what was not fitted, and the parameters."""
    _, law, begin = BY_HAND[case]

    def left(p: Floats) -> Floats:
        rest = [(run.thrust - law(p, run))[run.fitted] for run in fitted]
        return np.concatenate([r - r.mean() for r in rest])

    begun = [np.array(begin) * times for times in STARTS]
    tried = [least_squares(left, p, x_scale=p, bounds=(0.0, np.inf)) for p in begun]
    found = min(tried, key=lambda each: float(each.cost)).x
    missed = []
    for run in judged or fitted:
        rest = run.thrust - law(found, run)
        missed.append(rest - rest.mean() if judged else rest[~run.fitted] - rest[run.fitted].mean())
    return float(np.sqrt(np.mean(np.concatenate(missed) ** 2))), found


def by_hand(case: str, fitted: Sequence[Path], judged: Sequence[Path]) -> tuple[float, Floats]:
    """Of recordings that were imported."""
    prepared = prepare.run([load(p) for p in fitted], [load(p) for p in judged], None)
    if isinstance(prepared, Refusal):
        raise click.ClickException(prepared.reason)
    whole = bool(judged)
    pairs = zip(prepared.recordings, prepared.histories, strict=True)
    unseen = zip(prepared.held_out, prepared.unseen, strict=True)
    return error(case, [samples(*p, whole=whole) for p in pairs], [samples(*p, whole=True) for p in unseen])


def row(case: Case, hand: float, parameters: Floats, found: Diagnosis) -> str:
    names = ", ".join(f.effect for f in found.findings) or "none"
    tool = found.heldout.after
    model = f"{BY_HAND[case.name][0]} ({', '.join(f'{p:.3g}' for p in parameters)})"
    return f"| {case.name} | {model} | {hand:.3g} | {tool:.3g} | {tool / hand:.2f} | {found.verdict}: {names} |"


@click.command(help=__doc__)
@click.argument("root", metavar="FOLDER", type=click.Path(path_type=Path), default=HERE)
@click.option("--only", default="")
def main(root: Path, only: str) -> None:
    if not root.is_dir():
        print(f"{root} is not there; the real recordings are not part of the project")
        return
    print("| recording | by hand (its parameters) | by hand / N | tool / N | ratio | tool's verdict and names |")
    print("|---|---|---|---|---|---|")
    for case in CASES:
        if only not in case.name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            fitted, judged = (imported(root, case, pattern, Path(folder)) for pattern in (case.fitted, case.judged))
            print(row(case, *by_hand(case.name, fitted, judged), diagnose_files(fitted, judged)), flush=True)


if __name__ == "__main__":
    main()
