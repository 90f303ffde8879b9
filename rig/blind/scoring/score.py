"""One answer beside its truth. Pure: tables as they are in the files, arrays of the other run.

    right      each concealed effect is among the findings or their stated rivals; of a clean run: `adequate`
    alone      the findings are exactly what was concealed and the verdict is `explained`
    wrong      something is named, and of what was concealed nothing is among findings and rivals
    extra      a finding is not what was concealed, whatever stands beside it
    exact      the findings are what was concealed and no other, rivals stated or not, and nothing is `unexplained`

Of a second recording of a thruster, asked against the twin of the first, concealed is what came on top. What is told
as nothing that the first could have shown is not claimed to be new: it counts where nothing else is, and is no alarm.

Where the physics is outside the catalogue, or was taken out of it, the outcome counts: `located` (unexplained, in the
right place), `located, named` (the same, and a name beside it, wrong as every name is there), `misplaced` (unexplained,
elsewhere), `wrong name` (findings without `unexplained`), `missed` (adequate).
A diagnosis that crashed, refused or ran out of time has failed: it is never right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from identification.recording import Floats
from rig.blind.design import STRENGTHS, Order
from rig.blind.scoring.places import PLACES, UPSTREAM
from rig.blind.scoring.same_parameters import true_values
from rig.blind.scoring.sealed import concealed, described, strengths
from rig.blind.scoring.wired import Wired, wired

Table = Mapping[str, Any]

AS_RIVAL: Final = "among rivals"
"""The answer of a confusion matrix where the truth is a stated rival of what was found."""
OPEN_CELLS: Final = ("outside", "removed")
NOT_SHOWN: Final = "not shown before"
"""What a finding is `since` where nobody can tell whether it is new."""
LOCATED: Final = ("located", "located, named")
REFERRED: Final = frozenset({"exponent"})
"""Effects that refer C to a voltage, which is not the same on both sides."""
TELLABLE: Final = 8.0
"""sigma that the best neighbour must leave to an oracle, as much as a faint effect has."""


@dataclass(frozen=True, slots=True)
class Near:
    """The nearest neighbour in the catalogue, and the sigma that it leaves of the effect."""

    rival: str
    left: float


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Errors in another run, one constant fitted to each."""

    model: float
    """RMS of measured less predicted, over that of the true model."""
    baseline: float
    """The same of the baseline."""
    left: float
    """RMS of the model's own error over that of the baseline's."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A parameter that means the same in the world and in the catalogue."""

    effect: str
    parameter: str
    z: float
    """(estimate - truth) / stated standard error; infinite where none is stated."""
    covers: bool
    """Whether the truth is within the interval that was told."""


@dataclass(frozen=True, slots=True)
class Score:
    """What one order came to."""

    order: Order
    truth: tuple[str, ...]
    said: str
    """The verdict, or what went wrong."""
    named: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    place: str = ""
    resembles: tuple[str, ...] = ()
    statement: str = ""
    failed: bool = False
    near: Near | None = None
    held_out: HeldOut | None = None
    intervals: tuple[Interval, ...] = ()
    seconds: float = 0.0
    case: str = ""
    """What the recording was like, in words."""
    constant: Interval | None = None
    """C of the model; None where the answer has none, or what is concealed gives it another meaning."""
    strengths: tuple[float, ...] = ()
    """d' of each effect of `truth` beside the others; empty where a lie is among them."""
    known: tuple[str, ...] = ()
    """Effects that an earlier recording of the same thruster had as well."""
    wired: Wired | None = None
    """Of cases about the wiring of several runs: what was said of it."""
    not_shown: tuple[str, ...] = ()
    """Beside `named`, effects of which is said that an earlier recording could not have shown them."""

    @property
    def right(self) -> bool:
        if self.failed:
            return False
        if self.wired is not None:
            return self.wired.right
        if self.truth:
            return set(self.truth) <= {*self.named, *self.rivals, *self.not_shown}
        return self.said == "adequate" or (self.said != "unexplained" and bool(self.not_shown) and not self.named)

    @property
    def told(self) -> tuple[str, ...]:
        """What is claimed: what is new, or else what may be."""
        return self.named or self.not_shown

    @property
    def alone(self) -> bool:
        wanted = "explained" if self.truth else "adequate"
        return not self.failed and self.said == wanted and set(self.told) == set(self.truth)

    @property
    def wrong(self) -> bool:
        return bool(self.named) and not set(self.truth) & {*self.named, *self.rivals, *self.not_shown}

    @property
    def extra(self) -> bool:
        return bool(set(self.named) - set(self.truth))

    @property
    def exact(self) -> bool:
        told = ("explained", "ambiguous") if self.truth else ("adequate",)
        return not self.failed and self.said in told and set(self.told) == set(self.truth)

    @property
    def clear(self) -> tuple[str, ...]:
        """Concealed effects that an oracle sees at the strength called clear, or better."""
        return tuple(e for e, d in zip(self.truth, self.strengths, strict=False) if d >= STRENGTHS["clear"])

    @property
    def rival_only(self) -> bool:
        """Right, but something that was concealed is among the rivals alone."""
        return self.right and not set(self.truth) <= {*self.named, *self.not_shown}

    @property
    def counted(self) -> bool:
        """Whether an oracle tells this effect from its nearest neighbour as clearly as a faint effect from noise."""
        return self.leaves(TELLABLE)

    def leaves(self, sigma: float) -> bool:
        """Whether the nearest neighbour leaves that much."""
        return self.near is None or self.near.left >= sigma

    @property
    def outcome(self) -> str:
        """Of the open world."""
        if self.failed:
            return "failed"
        if self.said == "unexplained":
            named = LOCATED[bool(self.named)]
            return named if self.place in PLACES[self.truth[0]] else "misplaced"
        return "wrong name" if self.named else "missed"

    @property
    def good(self) -> bool:
        """As it should be, by the measure of its cell."""
        if self.order.cell in OPEN_CELLS:
            return self.outcome in LOCATED or not (self.counted or self.failed)
        if self.order.cell == "field":
            seen = set(self.clear) <= {*self.named, *self.rivals}
            return seen and not (self.failed or self.extra or self.said == "unexplained")
        return self.exact if self.order.cell == "difference" else self.right

    @property
    def answer(self) -> str:
        """One word for a confusion matrix."""
        if self.failed:
            return "failed"
        if self.right and self.truth:
            return AS_RIVAL if self.rival_only else self.truth[0]
        return self.named[0] if self.named else self.said


def scored(
    order: Order,
    truth: Table,
    answer: Table,
    thrust: tuple[Floats, Floats] | None = None,
    predicted: Mapping[str, Floats] | None = None,
) -> Score:
    """`thrust`: true and measured of the other run, `predicted`: by model and baseline; None where there is none."""
    hidden, near = concealed(truth), nearest(order, truth)
    if answer["error"]:
        seconds, seen = answer["seconds"], strengths(truth)
        case = described(truth)
        return Score(order, hidden, answer["error"], failed=True, near=near, seconds=seconds, case=case, strengths=seen)
    found = answer["diagnosis"]
    findings, unexplained = found["findings"], found["unexplained"]
    return Score(
        order=order,
        truth=hidden,
        said=found["verdict"],
        named=tuple(dict.fromkeys(f["effect"] for f in findings if f.get("since") != NOT_SHOWN)),
        rivals=tuple(dict.fromkeys(r for f in findings for r in f["rivals"])),
        place=unexplained["where"]["quantity"] if unexplained else "",
        resembles=tuple(unexplained["resembles"]) if unexplained else (),
        statement=found["statement"],
        near=near,
        held_out=held_out(*thrust, predicted) if thrust and predicted else None,
        intervals=intervals(findings, truth) if len(hidden) == 1 else (),
        seconds=answer["seconds"],
        case=described(truth),
        constant=thrust_constant(found, truth),
        strengths=strengths(truth),
        known=tuple(truth.get("known", ())),
        wired=wired(found, truth),
        not_shown=tuple(dict.fromkeys(f["effect"] for f in findings if f.get("since") == NOT_SHOWN)),
    )


def thrust_constant(found: Table, truth: Table) -> Interval | None:
    """C of the model that was found beside the true one."""
    told = found.get("model", {}).get("parameters", {}).get("C")
    if told is None or told["value"] is None or "baseline" not in truth or set(concealed(truth)) & REFERRED:
        return None
    value, std = float(truth["baseline"]["C"]), told["std"] or 0.0
    return Interval("", "C", (told["value"] - value) / std if std > 0.0 else float("inf"), _holds(told, value))


def nearest(order: Order, truth: Table) -> Near | None:
    """As the world measured it.

    In the open world a measured rate explains what happens before the rotor without knowing what it is: 0 sigma left.
    """
    upstream = bool(truth["effects"]) and truth["effects"][0]["effect"] in UPSTREAM
    if upstream and order.cell in OPEN_CELLS and "rotation_rate" in truth["channels"]:
        return Near("rotation_coupling", 0.0)
    twins = truth.get("twins")
    return Near(twins[0]["rival"], twins[0]["left"]) if twins else None


def held_out(true: Floats, measured: Floats, predicted: Mapping[str, Floats]) -> HeldOut:
    """Errors of the model and of the baseline, `model` and `baseline` (n,) N, in the other run.

    >>> t = np.array([0.0, 1.0, 0.0, 1.0])
    >>> found = held_out(t, t + [0.1, 0.1, -0.1, -0.1], {"model": t + 5.0, "baseline": 0.0 * t})
    >>> round(found.model, 6), round(found.baseline, 3), found.left
    (1.0, 5.099, 0.0)
    """
    noise = float(np.std(measured - true))
    model, baseline = (predicted[name] for name in ("model", "baseline"))
    own = float(np.std(baseline - true))
    return HeldOut(
        float(np.std(measured - model)) / noise,
        float(np.std(measured - baseline)) / noise,
        float(np.std(model - true)) / own if own > 0.0 else 0.0,
    )


def intervals(findings: list[Table], truth: Table) -> tuple[Interval, ...]:
    """Of the right findings' parameters that mean the same on both sides."""
    found, hidden = [], concealed(truth)
    for finding in (f for f in findings if f["effect"] in hidden):
        chosen = {name: told["value"] for name, told in finding["parameters"].items()}
        for name, value in true_values(finding["effect"], finding["form"], truth, chosen).items():
            told = finding["parameters"].get(name)
            if told is not None and told["value"] is not None:
                std = told["std"] or 0.0
                z = (told["value"] - value) / std if std > 0.0 else float("inf")
                found.append(Interval(finding["effect"], name, z, _holds(told, value)))
    return tuple(found)


def _holds(told: Table, value: float) -> bool:
    low, high = told["low"], told["high"]
    return low is not None and high is not None and bool(low <= value <= high)
