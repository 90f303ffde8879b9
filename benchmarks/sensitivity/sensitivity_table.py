"""The table of a sensitivity run, from what benchmarks/sensitivity/sensitivity.py put into its file.

python benchmarks/sensitivity/sensitivity_table.py [--out build/sensitivity.jsonl] [--also VERSION ...]   # prints it
python benchmarks/sensitivity/sensitivity_table.py --page          # puts it into docs/sensitivity.md
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from sensitivity_set import cases
from sensitivity_settings import ASKED, AT_VALUE, Setting, settings
from sensitivity_store import Row, costs, known, rows_of, version

from identification.mismatch import policy
from rig.blind.scoring.score import LOCATED, OPEN_CELLS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "sensitivity.md"
BEGIN, END = "<!-- by benchmarks/sensitivity/sensitivity_table.py -->", "<!-- end -->"
Answers = Mapping[str, Mapping[str, Row]]
"""Case -> setting -> answer."""


def lane(case: str) -> str:
    return case.partition("/")[0]


def shares(rows: Mapping[str, Row]) -> dict[str, float]:
    """Case -> answer in; per cent of the cases of which each is asked out; what none is asked of is left out."""
    concealed = [row for case, row in rows.items() if lane(case) not in (*OPEN_CELLS, "clean")]
    clean = [row for case, row in rows.items() if lane(case) == "clean"]
    opened = [row for case, row in rows.items() if lane(case) in OPEN_CELLS and row["counted"]]
    parts = {
        "right": [row["right"] for row in concealed],
        "alone": [row["alone"] for row in concealed],
        "wrong names": [row["wrong"] for row in concealed] + [row["outcome"] == "wrong name" for row in opened],
        "false alarms": [not row["right"] for row in clean],
        "unexplained": [row["said"] == "unexplained" for row in concealed],
        "open world located": [row["outcome"] in LOCATED for row in opened],
        "failed": [row["failed"] for row in rows.values()],
    }
    return {what: 100 * sum(part) / len(part) for what, part in parts.items() if part}


def answered_at(answers: Answers, setting: str) -> Answers:
    """The cases that were answered at a setting."""
    return {case: rows for case, rows in answers.items() if setting in rows}


def otherwise(answers: Answers, setting: str) -> tuple[int, int]:
    """Cases with other names, and with another verdict, of those that were answered at a setting."""
    pairs = [(rows[AT_VALUE], rows[setting]) for rows in answered_at(answers, setting).values()]
    return sum(a["named"] != b["named"] for a, b in pairs), sum(a["said"] != b["said"] for a, b in pairs)


def _line(answers: Answers, setting: Setting) -> str:
    asked = answered_at(answers, setting.id)
    whole = shares({case: rows[AT_VALUE] for case, rows in asked.items()})
    after = shares({case: rows[setting.id] for case, rows in asked.items()})
    told = " | ".join(f"{after[h]:.1f} ({after[h] - whole[h]:+.1f})" for h in whole)
    value = dict(policy.thresholds())[setting.threshold]
    names, verdicts = otherwise(asked, setting.id)
    moved = value.moved(setting.value)
    return (
        f"| {setting.threshold} ({value:g}) | {moved:g} | {told} | names {names}, verdict {verdicts} of {len(asked)} |"
    )


def table(answers: Answers) -> Iterator[str]:
    """Markdown, of the settings at which any case was answered otherwise; in brackets the difference."""
    whole = shares({case: rows[AT_VALUE] for case, rows in answers.items()})
    changing = [setting for setting in settings() if any(otherwise(answers, setting.id))]
    yield f"| threshold | at | {' | '.join(whole)} | answered otherwise |"
    yield f"|---|---|{'---|' * (len(whole) + 1)}"
    base = " | ".join(f"{share:.1f}" for share in whole.values())
    yield f"| all at their values, {len(answers)} cases | | {base} | |"
    yield from (_line(answers, setting) for setting in changing)
    still = [f"`{name}`" for name in ASKED if name not in {setting.threshold for setting in changing}]
    if still:
        yield ""
        yield f"At half and at double of {', '.join(still)} not one case was answered otherwise, in its names or in"
        yield "its verdict."


def text(answers: Answers, seconds: Sequence[float], code: str) -> str:
    clean = sum(lane(case) == "clean" for case in answers)
    number = len(settings()) + 1
    whole = [rows for rows in answers.values() if len(rows) == number]
    first = (
        f"The fixed set has {len(cases())} cases that are interleaved over the lanes; of these {len(answers)} were\n"
        f"answered at the values themselves and {len(whole)} at all {number} settings\n"
        f"({sum(map(len, answers.values())):,} answers, each by the rules of the proof), by\n"
        f"version {code} of the diagnosis, in {sum(seconds) / 3600:.1f} h of one core. Shares are per cent of\n"
        f"the cases of which each is asked ({clean} clean ones: one alarm is {100 / max(clean, 1):.1f} %); in\n"
        "brackets the difference to the values themselves, of the cases that were answered at the setting; settings\n"
        "at which none was answered otherwise have no line."
    )
    return "\n".join((first, "", *table(answers)))


def put(page: Path, told: str) -> None:
    """Between the marks of the page."""
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    if not after:
        raise SystemExit(f"{page} has no {BEGIN} with {END} behind it; put both where the table belongs")
    page.write_text(f"{before}{BEGIN}\n{told}\n{END}{after}", encoding="utf-8")


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/sensitivity.jsonl"), help="what the run wrote")
    parser.add_argument("--also", nargs="+", default=[], help="versions of the diagnosis whose answers count too")
    parser.add_argument("--page", action="store_true", help=f"put it into {PAGE.relative_to(ROOT)}")
    asked = parser.parse_args(arguments)
    versions = [version(), *asked.also]
    answers = {case: rows for case, rows in known(asked.out, versions).items() if rows}  # some could not be drawn
    if not answers:
        raise SystemExit(f"{asked.out} holds no case by version {', '.join(versions)}; work some out")
    answered = {row["version"] for row in rows_of(asked.out)}
    told = text(answers, costs(asked.out, versions), " and ".join(v for v in versions if v in answered))
    if asked.page:
        put(PAGE, told)
    else:
        print(told)


if __name__ == "__main__":
    main(sys.argv[1:])
