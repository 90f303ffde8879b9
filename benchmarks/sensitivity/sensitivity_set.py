"""The fixed set of concealed cases at which thresholds are moved, anew: sensitivity_cases.txt.

    python benchmarks/sensitivity/sensitivity_set.py

Of draw 2026-11-24 of the proof, of each lane so many as LANES says, its effects, forms or noises in turn, and of each
of those the first cases whose diagnosis took at most QUICK s in the proof (benchmarks/proof/scores.jsonl.gz): a case is
diagnosed some seven times over, and what is asked is what a threshold changes, not how good the diagnosis is. So rates
over the set are no figures of the proof. The lanes are interleaved: the first so many of the file are even, too.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from rig.blind.command import designed
from rig.blind.score_file import read

ROOT = Path(__file__).resolve().parents[2]
DRAW = "2026-11-24"
SCORES = ROOT / "benchmarks" / "proof" / "scores.jsonl.gz"
CASES = Path(__file__).with_name("sensitivity_cases.txt")
LANES = {
    "faint": 54,
    "clear": 54,
    "plain": 54,
    "variant": 16,
    "pair": 30,
    "clean": 60,
    "removed": 30,
    "outside": 22,
    "fault": 14,
}
"""Cases of each lane."""
QUICK = 6.0
"""s that a case of the set took at most in the proof; where an effect has none so quick, its quickest."""


def cases() -> list[str]:
    """The fixed set."""
    return CASES.read_text(encoding="utf-8").split()


def chosen() -> list[str]:
    """Quick cases of each lane, its labels in turn, the lanes interleaved."""
    seconds = {known.score.order.id: known.score.seconds for known in read(SCORES) if not known.score.failed}
    places = []
    for lane, count in LANES.items():
        by_label: dict[str, list[str]] = defaultdict(list)
        for job in designed(20, [lane], DRAW):
            for order in job.orders:
                if order.id in seconds or lane == "fault":
                    by_label[order.label].append(order.id)
        for label, found in by_label.items():
            number = sorted(found, key=lambda case: int(case.rsplit("/", 1)[1]))
            quick = [case for case in number if seconds.get(case, 0.0) <= QUICK]
            slow = sorted((case for case in number if case not in quick), key=lambda case: seconds[case])
            by_label[label] = [*quick, *slow]
        most = max(map(len, by_label.values()))
        turns = [cases[i] for i in range(most) for _, cases in sorted(by_label.items()) if i < len(cases)]
        places += [((i + 0.5) / count, lane, case) for i, case in enumerate(turns[:count])]
    return [case for _, _, case in sorted(places)]


if __name__ == "__main__":
    CASES.write_text("\n".join(chosen()) + "\n", encoding="utf-8")
