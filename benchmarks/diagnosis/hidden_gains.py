"""What a term gains that is told from noise only by estimating both: on clean recordings, and where it is concealed.

    python benchmarks/diagnosis/hidden_gains.py [N [EFFECT [SIGMA]]]  # 8 of each kind of noise, zero_drift, 8

The search tries a term that no screening finds by estimating term and noise together (`select.hidden`), and
believes it from a gain in deviance on; those prices (STEADY_TERM_FALSE_ALARM, HIDDEN_OFFSET_PRICE and HIDDEN_TERM_PRICE
of policy.select) were set by this table. On clean recordings every term that would be tried is told by the largest
gains it reached; then the gains of EFFECT where an oracle sees it at SIGMA. `asked` is the median of what the search
asks of it.

Zero and gain that wander over the run are told from noise in the same way, by a p-value (SLOW_CHANGE_FALSE_ALARM of
policy.locate): the smallest on the clean recordings, and where EFFECT is concealed and in no catalogue.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.locate.slow_change import slow_changes
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.prepare.stage import histories_of
from identification.mismatch.select import forward_selection as search
from identification.mismatch.select import hidden as unhiding
from identification.mismatch.select.baseline import baseline, start
from identification.mismatch.select.screening import Screening, directions, refined, screen
from identification.mismatch.select.shape_error import allowed, corrections
from sim_devices import concealed
from tests.concealed.recordings import recordings

SEED = 90_000
"""Apart from the cases of the tests and of every proof."""
LEAST = 1.5
"""Sigmas of the screening from which a term is looked at here: fewer than the search asks for."""
SHOWN = 5


@dataclass(frozen=True, slots=True)
class Gain:
    """Of one term on one recording."""

    term: str
    screened: float
    """Sigmas of the screening, which did not pass."""
    gain: float
    asked: float


@dataclass(frozen=True, slots=True)
class Seen:
    """On one recording where the screening finds nothing."""

    gains: tuple[Gain, ...] = ()
    """Of every term that is likely enough."""
    slow: tuple[float, ...] = ()
    """p-values of a zero, a gain and a gain that wander, the last one quicker."""


def seen(case: concealed.Case, *without: str) -> Seen:
    """Of effects `without` nothing is asked: they are in no catalogue."""
    histories = histories_of(recordings(case))
    if isinstance(histories, Refusal):
        return Seen()
    data, theta = start(histories)
    terms = search.available(data, without)
    estimate = baseline(data, theta, terms, Model())
    found = directions(estimate.fit, data, estimate.weights, terms)
    changes = corrections(estimate.fit, data, estimate.weights)
    spared = allowed(changes, found.columns, policy.select.NEXT_TERM_SHAPE_ERROR)
    judged = screen(estimate.fit, found, np.random.default_rng(0), spared)
    if judged.largest > judged.threshold:
        return Seen()
    return Seen(tuple(_tried(estimate, judged, data)), tuple(p for p, _ in slow_changes(estimate, data)))


def _tried(estimate: Estimate, judged: Screening, data: Data) -> Iterator[Gain]:
    now = refresh(estimate.fit.model, estimate.fit.theta, data, None, None)
    for term, values, screened in judged.best(2 * unhiding.MOST_HIDDEN):
        if screened < LEAST:
            continue
        begin = refined(estimate.fit, data, estimate.weights, term, values)
        bigger, theta = estimate.fit.more(term, begin)
        first = fit(bigger, theta, data, estimate.weights)
        new = refresh(bigger, first.theta, data, None, now, now.noise)
        asked = unhiding.asked_of(term, judged, data)
        yield Gain(term.id, screened, now.fit.deviance - new.fit.deviance, asked)


def clean(count: int) -> tuple[dict[str, list[Gain]], list[tuple[float, ...]]]:
    """Gains by term, and the p-values of slow changes."""
    gains: dict[str, list[Gain]] = defaultdict(list)
    slow = []
    for kind in concealed.NOISE_KINDS:
        for i in range(count):
            found = seen(concealed.case(np.random.default_rng([SEED, i]), noise=kind))
            slow.append(found.slow)
            for gain in found.gains:
                gains[gain.term].append(gain)
    return gains, [each for each in slow if each]


def hidden(effect: str, sigma: float, count: int) -> tuple[list[Gain], list[tuple[float, ...]], int]:
    """Of the effect itself, in the form that gains most; of slow changes, in no catalogue; how many could be drawn."""
    gains, slow, drawn = [], [], 0
    for i in range(count):
        try:
            case = concealed.case(np.random.default_rng([SEED, i, 1]), [effect], sigma)
        except concealed.OutOfReach:
            continue
        drawn += 1
        forms = [found for found in seen(case).gains if found.term == effect]
        if forms:
            gains.append(max(forms, key=lambda each: each.gain - each.asked))
        slow.append(seen(case, effect).slow)
    return gains, [each for each in slow if each], drawn


def main(count: int = 8, effect: str = "zero_drift", sigma: float = 8.0) -> None:
    kinds = len(concealed.NOISE_KINDS)
    print(f"{count * kinds} clean recordings, {kinds} kinds of noise\n")
    print(f"{'term':<22}{'tried':>6}{'asked':>8}   largest gains")
    gains, slow = clean(count)
    for term, found in sorted(gains.items(), key=lambda each: -max(g.gain for g in each[1])):
        largest = sorted((g.gain for g in found), reverse=True)[:SHOWN]
        asked = median(g.asked for g in found)
        print(f"{term:<22}{len(found):>6}{asked:>8.1f}   {' '.join(f'{x:.1f}' for x in largest)}")
    mine, unknown, drawn = hidden(effect, sigma, count * kinds)
    told = sum(g.gain > g.asked for g in mine)
    print(f"\n{effect} at {sigma:g} sigma in {drawn} recordings: {len(mine)} left to be told from noise, of which")
    print(f"{told} gain what is asked; gains {' '.join(f'{g.gain:.1f}' for g in mine)}")
    print(f"\n{'slow changes':<30}{'recordings':>10}{f'p < {policy.locate.SLOW_CHANGE_FALSE_ALARM:g}':>12}   smallest")
    for what, each in (("clean", slow), (f"{effect}, in no catalogue", unknown)):
        least = sorted(min(p) for p in each)
        smallest = " ".join(f"{p:.1g}" for p in least[:SHOWN])
        print(
            f"{what:<30}{len(each):>10}{sum(p < policy.locate.SLOW_CHANGE_FALSE_ALARM for p in least):>12}   {smallest}"
        )


if __name__ == "__main__":
    words = sys.argv[1:]
    main(*(kind(word) for kind, word in zip((int, str, float), words, strict=False)))
