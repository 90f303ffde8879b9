"""docs/method-thresholds.md, written from the thresholds themselves.

python -m identification.mismatch.policy.record.page > docs/method-thresholds.md
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import groupby

from identification.mismatch.policy.record.budget import Alarm, false_alarms, nominal
from identification.mismatch.policy.record.every import ROOMS, thresholds
from identification.mismatch.policy.record.threshold import Count, Threshold

HEAD = """# Every number that decides

Written by `python -m identification.mismatch.policy.record.page` from `identification/mismatch/policy`, where each
threshold stands once; a test keeps this page to it. A *threshold* decides what is claimed, doubted, kept, dropped,
counted as noise or refused; vehicles use those of thrusters beside their own. What depends on a number is asked by
`python benchmarks/sensitivity/sensitivity.py`, which puts the twenty of the most consequence at half and at double.
"""
ALARMS = """## What can alarm on a clean recording

Nominal rates, as the thresholds say; [what was measured](howto/diagnose.md#false-alarms).
"""


def page() -> str:
    """The whole page, ending with a line break."""
    every = list(thresholds())
    told = sum(bool(value.evidence) for _, value in every)
    counted = f"{len(every)} thresholds, {told} of them with evidence: a benchmark of this repository, or literature."
    parts = [HEAD, f"{counted}\n", ALARMS, "\n".join(_alarms()), ""]
    what = {room.__name__.rpartition(".")[2]: (room.__doc__ or "").strip() for room in ROOMS}
    for room, values in groupby(every, key=lambda each: each[0].partition(".")[0]):
        parts += [
            f"## `{room}`",
            what[room].replace("Thresholds: ", "").capitalize(),
            "",
            "\n".join(_table(values)),
            "",
        ]
    return "\n".join(parts).rstrip() + "\n"


def _alarms() -> Iterator[str]:
    yield "| test | nominal | of what |"
    yield "|---|---|---|"
    counted = [alarm for alarm in false_alarms() if alarm.counted]
    yield from map(_alarm, counted)
    yield f"| **sum** | **{percent(nominal())}** | a clean recording of a thruster, diagnosed without a twin |"
    yield from (_alarm(alarm) for alarm in false_alarms() if not alarm.counted)


def _alarm(alarm: Alarm) -> str:
    said = percent(alarm.rate) + ("" if alarm.counted else ", not in the sum")
    return f"| {alarm.name} | {said} | {alarm.of} |"


def percent(share: float) -> str:
    """Three digits of it.

    >>> percent(0.0205302), percent(0.01), percent(3e-5)
    ('2.05 %', '1 %', '0.003 %')
    """
    return f"{100 * share:.3g} %" if share >= 1e-5 else f"{100 * share:.0e} %"


def _table(values: Iterator[tuple[str, Threshold | Count]]) -> Iterator[str]:
    yield "| name | value | unit | why | evidence |"
    yield "|---|---|---|---|---|"
    for name, value in values:
        shown = [f"`{name.partition('.')[2]}`", f"{value:g}", value.unit, value.reason, value.evidence]
        yield f"| {' | '.join(cell.replace('|', '&#124;') for cell in shown)} |"


if __name__ == "__main__":
    sys.stdout.write(page())
