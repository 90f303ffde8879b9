"""What a diagnosis comes to: the verdict as a sum type, and all that a person or a program needs with it. Data only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from identification.mismatch import policy
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import Value, Where
from identification.mismatch.verdict_clauses import (
    beside,
    errors,
    in_part,
    missing,
    named_share,
    to_settle,
    unsettled,
)
from identification.recording import Floats
from identification.twin import Twin


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
    """Of the best of `searched` alternatives."""
    bic_gain: float
    probability: float
    """Its weight among the effects that were asked, which that it is none of these is not."""
    rivals: tuple[RivalFinding, ...]
    share: float | None = None
    """Of the squared error on what was not fitted that anything could take off, how much this does, 0 to 1."""
    heldout: tuple[float, float] | None = None
    """RMSE per sample on what was not fitted, without it and with it."""
    doubts: tuple[str, ...] = ()
    """Why it is not the whole of it: checks of its shape that it failed."""
    searched: int | None = 1
    """Alternatives that were looked at; None where its test counts them otherwise."""
    asked: int = 1
    """Effects that were fitted in its place, and itself."""
    channels: tuple[str, ...] = ()
    """Of a channel fault, quantities: the one that lies, and the one that it was exchanged with."""
    recording: str = ""
    """Of a channel fault, the id of the recording that it is in."""
    in_measurement: bool = False
    """Whether it is of the stand, the cell or a channel: what is measured has it, the thruster's thrust has not."""
    since: Literal["", "changed", "not shown before"] = ""
    """Beside a twin: new since its own recordings, or nothing that those could have shown; empty: nobody asked."""
    before: Mapping[str, Value] = field(default_factory=dict)
    """Of an effect that a twin or a simulation has in the same form: its values there. Empty: it has it not, or has it
    in addition."""

    def __post_init__(self) -> None:
        if self.bic_gain <= 0:
            raise ValueError(f"{self.effect} does not pay for its parameters (BIC worse by {-self.bic_gain:.3g})")

    @property
    def grade(self) -> Literal["all", "mostly", "partly"]:
        """How much of what could be explained it is."""
        if self.share is None:
            return "all"
        if self.share >= policy.unnamed.ALL_SHARE and not self.doubts:
            return "all"
        return "mostly" if self.share >= policy.unnamed.MOSTLY_SHARE else "partly"


@dataclass(frozen=True, slots=True)
class Rmse:
    """Root mean square errors of baseline and final model, in the unit of the response."""

    before: float
    after: float


@dataclass(frozen=True, slots=True)
class HeldOutRmse:
    """The same on what was not fitted, beside the noise of one sample in that unit; `what`: which part that is."""

    before: float
    after: float
    noise: float
    what: str
    growth_p: float = 1.0
    """How often chance makes an error that did not grow seem to have grown so much."""
    whitened_fall: float = 0.0
    """By how much chi-square falls there with the slow noise taken out, beyond what its parameters are worth; 0 or less
    where it does not, or where nobody asked."""

    @property
    def hidden(self) -> bool:
        """Whether slow noise alone makes it seem no better: with that taken out it is."""
        by_chance = self.growth_p >= policy.validate.GROWN_P
        return self.after >= self.before and by_chance and self.whitened_fall > 0

    @property
    def grown(self) -> bool:
        """Whether the model predicts what was not fitted worse than the baseline, beyond chance."""
        plainly = self.after > policy.validate.GROWN_RATIO * self.before and not self.hidden
        return plainly or (self.after > self.before and self.growth_p < policy.validate.GROWN_P)

    @property
    def beyond_noise(self) -> bool:
        """Whether the model's error on what was not fitted is so far above the noise that it explains too little."""
        return self.noise > 0 and self.after > policy.validate.EXPLAINED_NOISE * self.noise


@dataclass(frozen=True, slots=True)
class PlanStep:
    """A hold of the next experiment: a level for `duration` s in water that flows at `flow_speed` m/s."""

    command_voltage: float
    """V, or what the `quantity` of its experiment is measured in."""
    duration: float
    flow_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class NextExperiment:
    """Steps that would settle which of several models is right, and the probability that they do; without any where no
    sweep does, and `why` says what else would."""

    why: str
    steps: tuple[PlanStep, ...]
    expected_power: float
    quantity: str = "command_voltage"
    """What the steps hold: `rotation_rate` where the recordings have no voltage."""

    @property
    def unit(self) -> str:
        return "rev/s" if self.quantity == "rotation_rate" else "V"


@dataclass(frozen=True, eq=False, slots=True)
class Adequate:
    """Nothing is missing, at the stated false-alarm rate."""

    name: ClassVar[Literal["adequate"]] = "adequate"


@dataclass(frozen=True, eq=False, slots=True)
class Explained:
    """The findings account for the mismatch, and what remains is noise."""

    name: ClassVar[Literal["explained"]] = "explained"
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Ambiguous:
    """Some finding has a rival that does as well."""

    name: ClassVar[Literal["ambiguous"]] = "ambiguous"
    findings: tuple[Finding, ...]
    next_experiment: NextExperiment | None
    """The sweep that tells the rivals apart; None where the bench allows none."""


@dataclass(frozen=True, eq=False, slots=True)
class Unexplained:
    """Structure is left that no term of the catalogue carries; what is known beside it is in the findings."""

    name: ClassVar[Literal["unexplained"]] = "unexplained"
    findings: tuple[Finding, ...]
    remainder: Remainder
    next_experiment: NextExperiment | None


Verdict = Adequate | Explained | Ambiguous | Unexplained
VerdictName = Literal["adequate", "explained", "ambiguous", "unexplained"]


@dataclass(frozen=True, slots=True)
class Equation:
    """A line of the model, to be typed in."""

    line: str
    effect: str = ""
    """That it is of; empty: of the baseline's form, C V|V| and the tare."""


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
    """All that was found of one thruster or vehicle: the verdict, where the baseline fails, the model that does not,
    how well it predicts, and what a report draws.
    """

    recordings: tuple[str, ...]
    thruster: str
    answer: Verdict
    baseline_model: str
    baseline: Mapping[str, Value]
    mismatch: tuple[Mismatch, ...]
    model_terms: tuple[str, ...]
    model: Mapping[str, Value]
    """`C`, tares and `effect.parameter` of the final model."""
    train: Rmse
    heldout: HeldOutRmse
    chi2_per_dof: float
    whiteness_p: float
    notes: tuple[str, ...] = ()
    curves: tuple[Curves, ...] = field(default=(), repr=False)
    twin: Twin | None = field(default=None, repr=False)
    """The final model with its numbers: what `--save-twin` writes."""
    response: str = "thrust"
    """What is explained: of a vehicle its `position`, `depth`, `heading` or `speed`."""
    unit: str = "N"
    """Of the response and its errors."""
    not_new: tuple[str, ...] = ()
    """Statements of what a twin lacks and its own recordings have as well."""
    force_unit: str = "N"
    """Of the shape of what is not explained: of a vehicle a force all the same."""
    equations: tuple[Equation, ...] = ()
    """The final model line by line, in the order in which the bench acts; of a vehicle none."""
    gain_std: float = 0.0
    """Relative standard uncertainty of all thrusts, and of C, by the load cell's calibration, which is not in the
    errors of the model; 0: not stated."""

    @property
    def white(self) -> bool:
        """Whether the whitened residual is white, as far as its correlations tell."""
        return self.whiteness_p >= policy.answer.WHITE_P

    @property
    def verdict(self) -> VerdictName:
        """The answer's name."""
        return self.answer.name

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was left out, by name; channel faults first, the clearest first among the others."""
        return () if isinstance(self.answer, Adequate) else self.answer.findings

    @property
    def unexplained(self) -> Remainder | None:
        """What no name carries."""
        return self.answer.remainder if isinstance(self.answer, Unexplained) else None

    @property
    def next_experiment(self) -> NextExperiment | None:
        """What would settle an answer that is still open."""
        return self.answer.next_experiment if isinstance(self.answer, Ambiguous | Unexplained) else None

    @property
    def statement(self) -> str:
        """The verdict in one sentence."""
        match self.answer:
            case Adequate() if self.not_new:
                return f"Nothing has changed. What is not in the baseline was there before: {' '.join(self.not_new)}"
            case Adequate():
                return f"Nothing is missing: {self.baseline_model} describes these recordings within their noise."
            case Explained(findings):
                return self._left_out([(f, f.statement) for f in findings])
            case Ambiguous(findings):
                told = [(f, f.statement) for f in findings if not f.rivals]
                told += [(f, unsettled(f)) for f in findings if f.rivals]
                return f"{self._left_out(told)} {to_settle(self.next_experiment)}"
            case Unexplained(findings, remainder):
                return beside(findings, remainder.statement, self.heldout, self.unit, self.nameless)

    @property
    def named_share(self) -> float | None:
        """Of the rms error beyond the noise that the baseline has on what was not fitted, how much is gone with the
        names, 0 to 1; None where nothing is named, or there is no error beyond the noise.
        """
        return named_share(self.findings, self.heldout, self.nameless)

    @property
    def headline(self) -> str:
        """The verdict for people: unexplained where nothing is known is not the same as where nearly all is."""
        share = self.named_share
        if self.unexplained is None or self.unexplained.unpredictive or share is None:
            return self.verdict
        return in_part(share) if share >= policy.answer.LEAST_SHARE_TOLD else self.verdict

    @property
    def nameless(self) -> str:
        """What is in the model beside names; empty where nothing is."""
        if self.unexplained is not None and self.unexplained.flexible:
            return "a free curve, which is no physics"
        named = {f.effect for f in self.findings}
        of_twin = {parameter.partition(".")[0] for parameter in self.baseline}
        return "terms that have no name" if set(self.model_terms) - named - of_twin else ""

    def _left_out(self, told: Sequence[tuple[Finding, str]]) -> str:
        """Of the findings, each told, and what they do together."""
        return " ".join([*missing(told), errors(self.findings, self.heldout, self.unit)]).rstrip()
