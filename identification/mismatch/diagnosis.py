"""The answer: adequate, explained, ambiguous or unexplained, and all that a person or a program needs with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Literal

from identification.mismatch.answer.remainder import FlexibleShape, FormulaFound, flexible_json, formula_json
from identification.recording import Floats
from identification.twin import Twin

QUANTILE = 1.959964
"""Standard errors to the end of a 95 % interval."""

WHITE = 0.01
"""p-value of whiteness below which what remains is called not white."""
NOT_WHITE = (
    "intervals and p-values rest on the noise model, which does not describe all of it: they may be surer than they "
    "should"
)

Verdict = Literal["adequate", "explained", "ambiguous", "unexplained"]


@dataclass(frozen=True, slots=True)
class Value:
    value: float
    std: float
    """Such that value +- 1.96 std holds the whole 95 % interval."""
    unit: str
    ends: tuple[float, float] | None = None
    """Of the 95 % interval, where it is not value +- 1.96 std."""

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval; NaN where the data do not determine the value."""
        half = QUANTILE * self.std
        return self.ends or (self.value - half, self.value + half)


@dataclass(frozen=True, slots=True)
class Where:
    """A stretch of a quantity of recording-format.md, or of time, time_since_step, previous_voltage, direction ..."""

    quantity: str
    low: float
    high: float
    unit: str


@dataclass(frozen=True, slots=True)
class Mismatch:
    """Where the baseline and the recording disagree."""

    channel: str
    where: Where
    share: float
    """Of the residual's sum of squares, within the stretch."""
    p_value: float
    statement: str


@dataclass(frozen=True, eq=False)
class RivalFinding:
    """Another effect that explains it about as well."""

    effect: str
    form: str
    parameters: Mapping[str, Value]
    bic_loss: float
    statement: str


@dataclass(frozen=True, eq=False)
class Finding:
    """One effect that was left out."""

    effect: str
    form: str
    statement: str
    parameters: Mapping[str, Value]
    p_value: float
    bic_gain: float
    probability: float
    rivals: tuple[RivalFinding, ...]


@dataclass(frozen=True, eq=False)
class Unexplained:
    """Structure that no term of the catalogue carries."""

    where: Where
    share: float
    p_value: float
    shape: tuple[tuple[float, float, float], ...]
    """(covariate, mean residual in N, its standard error) bin by bin."""
    statement: str
    resembles: tuple[str, ...] = ()
    """Effects that fit but whose name was not earned, each with the reason."""
    flexible: tuple[FlexibleShape, ...] = ()
    """Of the final model, the clearest first; empty where none predicts better what was not fitted."""
    equals: tuple[str, ...] = ()
    """Coordinates over which the first flexible term would have done about as well."""
    replaces: tuple[str, ...] = ()
    """Effects whose name was not earned and whose place the flexible terms take."""
    heldout_without: float | None = None
    """RMSE per sample on what was not fitted, without the flexible terms, N."""
    formula: FormulaFound | None = None


@dataclass(frozen=True, slots=True)
class Rmse:
    before: float
    after: float


@dataclass(frozen=True, slots=True)
class HeldOutRmse:
    before: float
    after: float
    noise: float
    what: str


@dataclass(frozen=True, slots=True)
class PlanStep:
    command_voltage: float
    """V, or what the `quantity` of its experiment is measured in."""
    duration: float
    flow_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class NextExperiment:
    why: str
    steps: tuple[PlanStep, ...]
    expected_power: float
    quantity: str = "command_voltage"
    """What the steps hold: `rotation_rate` where the recordings have no voltage."""

    @property
    def unit(self) -> str:
        return "rev/s" if self.quantity == "rotation_rate" else "V"


@dataclass(frozen=True, eq=False)
class Curves:
    """What a report draws, per run: on the intervals with thrust, (n,) each."""

    recording_id: str
    time: Floats
    driver: Floats
    thrust: Floats
    baseline: Floats
    model: Floats


@dataclass(frozen=True, eq=False)
class Diagnosis:
    recordings: tuple[str, ...]
    thruster: str
    verdict: Verdict
    baseline_model: str
    baseline: Mapping[str, Value]
    mismatch: tuple[Mismatch, ...]
    findings: tuple[Finding, ...]
    unexplained: Unexplained | None
    model_terms: tuple[str, ...]
    model: Mapping[str, Value]
    """`C`, tares and `effect.parameter` of the final model."""
    train: Rmse
    heldout: HeldOutRmse
    chi2_per_dof: float
    whiteness_p: float
    next_experiment: NextExperiment | None
    notes: tuple[str, ...] = ()
    curves: tuple[Curves, ...] = field(default=(), repr=False)
    twin: Twin | None = field(default=None, repr=False)
    """The final model with its numbers: what `--save-twin` writes."""
    response: str = "thrust"
    """What is explained: of a vehicle its `position`, `depth`, `heading` or `speed`."""
    unit: str = "N"
    """Of the response and its errors."""
    force_unit: str = "N"
    """Of the shape of what is not explained: of a vehicle a force all the same."""

    @property
    def white(self) -> bool:
        """Whether the whitened residual is white, as far as its correlations tell."""
        return self.whiteness_p >= WHITE

    @property
    def statement(self) -> str:
        """The verdict in one sentence."""
        match self.verdict:
            case "adequate":
                return f"Nothing is missing: {self.baseline_model} describes these recordings within their noise."
            case "explained":
                return "Left out: " + " ".join(f.statement for f in self.findings)
            case "ambiguous":
                rivals = "; ".join(_either(f) for f in self.findings if f.rivals)
                sure = " ".join(f.statement for f in self.findings if not f.rivals)
                known = f" Left out besides: {sure}" if sure else ""
                return f"These recordings cannot tell {rivals}: run the next experiment.{known}"
            case _:
                assert self.unexplained is not None
                known = " Known: " + " ".join(f.statement for f in self.findings) if self.findings else ""
                return self.unexplained.statement + known


def _either(f: Finding) -> str:
    """It or its rivals; by form, where they are one effect."""
    every = [(f.effect, f.form), *((r.effect, r.form) for r in f.rivals)]
    same = len({effect for effect, _ in every}) < len(every)
    return " or ".join(f"{effect} ({form})" if same and form else effect for effect, form in every)


def diagnosis_json(d: Diagnosis) -> dict[str, object]:
    """`thruster-rig-diagnosis` version 1, see docs/howto/diagnose.md."""
    return {
        "format": "thruster-rig-diagnosis",
        "version": 1,
        "recordings": list(d.recordings),
        "thruster": d.thruster,
        "response": {"quantity": d.response, "unit": d.unit, "force_unit": d.force_unit},
        "verdict": d.verdict,
        "statement": d.statement,
        "baseline": {"model": d.baseline_model, "parameters": _values(d.baseline)},
        "mismatch": [
            {
                "channel": m.channel,
                "where": _where(m.where),
                "share": _number(m.share),
                "p_value": _number(m.p_value),
                "statement": m.statement,
            }
            for m in d.mismatch
        ],
        "findings": [_finding(f) for f in d.findings],
        "unexplained": None if d.unexplained is None else _unexplained(d.unexplained),
        "model": {"terms": list(d.model_terms), "parameters": _values(d.model)},
        "fit": {
            "train": {"rmse_before": _number(d.train.before), "rmse_after": _number(d.train.after)},
            "heldout": {
                "rmse_before": _number(d.heldout.before),
                "rmse_after": _number(d.heldout.after),
                "noise": _number(d.heldout.noise),
                "what": d.heldout.what,
            },
            "chi2_per_dof": _number(d.chi2_per_dof),
            "whiteness_p": _number(d.whiteness_p),
        },
        "next_experiment": None
        if d.next_experiment is None
        else {
            "why": d.next_experiment.why,
            "steps": [
                {d.next_experiment.quantity: s.command_voltage, "duration": s.duration, "flow_speed": s.flow_speed}
                for s in d.next_experiment.steps
            ],
            "expected_power": _number(d.next_experiment.expected_power),
        },
        "notes": list(d.notes),
    }


def _number(x: float) -> float | None:
    return float(x) if isfinite(x) else None


def _values(values: Mapping[str, Value]) -> dict[str, object]:
    out: dict[str, object] = {}
    for name, v in values.items():
        low, high = v.interval
        told = {"value": _number(v.value), "std": _number(v.std), "low": _number(low), "high": _number(high)}
        out[name] = {**told, "unit": v.unit}
    return out


def _where(w: Where) -> dict[str, object]:
    return {"quantity": w.quantity, "from": _number(w.low), "to": _number(w.high), "unit": w.unit}


def _finding(f: Finding) -> dict[str, object]:
    return {
        "effect": f.effect,
        "form": f.form,
        "statement": f.statement,
        "parameters": _values(f.parameters),
        "p_value": _number(f.p_value),
        "bic_gain": _number(f.bic_gain),
        "probability": _number(f.probability),
        "rivals": [r.effect for r in f.rivals],
        "rival_details": [
            {
                "effect": r.effect,
                "form": r.form,
                "parameters": _values(r.parameters),
                "bic_loss": _number(r.bic_loss),
                "statement": r.statement,
            }
            for r in f.rivals
        ],
    }


def _unexplained(u: Unexplained) -> dict[str, object]:
    return {
        "where": _where(u.where),
        "share": _number(u.share),
        "p_value": _number(u.p_value),
        "shape": [{"at": _number(a), "residual": _number(b), "std": _number(c)} for a, b, c in u.shape],
        "statement": u.statement,
        "resembles": list(u.resembles),
        "equals": list(u.equals),
        "flexible": flexible_json(u.flexible, u.replaces, u.heldout_without),
        "formula": None if u.formula is None else formula_json(u.formula),
    }
