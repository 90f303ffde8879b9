"""Answers of the methods, and the figures that are counted from them. Knows none of the methods."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rig.blind.beside import AtStrength, Method, Named

OUTCOMES = ("alone", "among", "wrong", "none")


@dataclass(frozen=True, slots=True)
class Answer:
    method: str
    kind: str
    effect: str
    seed: int
    named: tuple[str, ...]
    rivals: tuple[str, ...]
    error: float
    """Of the noise."""
    seconds: float
    setting: dict[str, Any] = field(default_factory=dict)
    code: str = ""
    """Of what made the recording and the answer: an answer of other code is not counted."""

    @property
    def outcome(self) -> str:
        if not self.effect:
            return "false alarm" if self.named else "quiet"
        if self.effect in self.named:
            return "alone" if len(set(self.named)) == 1 and not self.rivals else "among"
        if self.effect in self.rivals:
            return "among"
        return "wrong" if self.named else "none"


def counted(
    answers: Sequence[Answer], names: Sequence[str], strengths: Mapping[str, float], bare: str = ""
) -> tuple[Method, ...]:
    """Of those `names` that answered. `strengths`: sigma by kind, 0 of the clean one; `bare` names nothing."""
    mine = {name: [a for a in answers if a.method == name] for name in names}
    return tuple(_method(name, some, strengths, naming=name != bare) for name, some in mine.items() if some)


def _method(name: str, answers: Sequence[Answer], strengths: Mapping[str, float], *, naming: bool) -> Method:
    counts = Counter(a.outcome for a in answers)
    by_kind = {d: [a for a in answers if a.kind == kind] for kind, d in strengths.items() if d > 0.0}
    at = tuple(_at(d, some, naming=naming) for d, some in by_kind.items() if some)
    return Method(name, answers[0].setting, at, counts["false alarm"], counts["quiet"])


def _at(strength: float, answers: Sequence[Answer], *, naming: bool) -> AtStrength:
    counts, errors = Counter(a.outcome for a in answers), [a.error for a in answers]
    return AtStrength(
        strength,
        Named(*(counts[outcome] for outcome in OUTCOMES)) if naming else None,
        _below(errors, 0.5),
        _below(errors, 0.95),
        float(np.median([a.seconds for a in answers])),
    )


def _below(errors: Sequence[float], share: float) -> float | None:
    """None where a prediction ran away."""
    return float(np.quantile(errors, share)) if np.all(np.isfinite(errors)) else None


def table(found: Iterable[Method]) -> str:
    """As docs/howto/peers.md has it."""
    columns = "| right alone | right among names | wrong | none |"
    head = f"| method | strength {columns} error, median | error, 95 % | false alarms | CPU s, median |"
    return "\n".join([head, "|---" * 10 + "|", *(_row(method, at) for method in found for at in method.at)])


def _row(method: Method, at: AtStrength) -> str:
    shares, alarms, seconds = [""] * len(OUTCOMES), "", ""
    if at.named is not None:
        shares = [f"{100 * getattr(at.named, outcome) / at.named.n:.0f} %" for outcome in OUTCOMES]
        alarms, seconds = f"{method.alarms} of {method.alarms + method.quiet}", f"{at.seconds:.1f}"
    errors = ("" if e is None else f"{e:{how}}" for e, how in ((at.error_median, ".3f"), (at.error_95, ".2f")))
    return f"| {' | '.join((method.name, f'{at.strength:.0f}', *shares, *errors, alarms, seconds))} |"
