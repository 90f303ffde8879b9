"""Figures of several draws of the proof together: one draw of a lane has 24 cases, and a goal of 2 % needs more.

    python benchmarks/diagnosis/pooled.py benchmarks/proof/lanes.jsonl.gz benchmarks/proof/bench-2038-02-01.jsonl.gz

As rows of a Markdown table. What two files hold of one case counts once for each: give no draw twice.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rig.blind.score_file import read
from rig.blind.scoring.metrics import besides, goals
from rig.blind.scoring.rates import Goal


def row(goal: Goal) -> str:
    return f"| {goal.what.replace('_', ' ')} | {measured(goal)} | {goal.wanted} |"


def measured(goal: Goal) -> str:
    if not goal.percent:
        return f"{goal.value:.3f} (n {goal.n:,})"
    return f"{100 * goal.value:.1f} % ({100 * goal.low:.1f} to {100 * goal.high:.1f}, n {goal.n:,})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scores", nargs="+", type=Path)
    scores = [known.score for path in parser.parse_args().scores for known in read(path)]
    print("| | measured (95 % interval) | goal |\n|---|---|---|")
    print(*(row(each) for each in (*goals(scores), *besides(scores)) if each.n), sep="\n")


if __name__ == "__main__":
    main()
