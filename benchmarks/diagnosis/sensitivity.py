"""What half and double of the thresholds that matter most would change in the answers.

    python benchmarks/diagnosis/sensitivity.py [--jobs 2] [--out build/sensitivity.jsonl] [--cases N] [--only NAME ...]
    python benchmarks/diagnosis/sensitivity.py --table       # of what is in the file
    python benchmarks/diagnosis/sensitivity.py --choose      # the fixed set anew, from benchmarks/proof/scores.jsonl.gz

Each of the thresholds in ASKED is put at half and at double, one at a time (`policy.overridden`), and every case of a
fixed set is answered as in the blind proof: `python -m sim_devices conceal` makes recordings and seals the truth,
`rig.blind.answering.answered` diagnoses, `rig.blind.scoring` puts both side by side. The set is in
sensitivity_cases.txt: cases of draw 2026-11-24 that took a few seconds, so that its rates are no figures of the proof;
differences within the table are what it tells. All settings of one case are answered one after the other,
and cases are interleaved over the lanes: whatever is done when it is broken off is even. The same command goes on
where it ended, with the same version of the diagnosis.

334 cases at 41 settings are 13,694 answers. Where no comparison of a case would have come out otherwise
(watched_thresholds.py), its answer at the setting is the one at the values themselves, and is not worked out again;
`--check` works it out all the same, and ends where it differs.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import signal
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from watched_thresholds import watched

from identification.mismatch import policy
from rig.blind.answering import answered
from rig.blind.command import designed
from rig.blind.score_file import read
from rig.blind.scoring.score import LOCATED, OPEN_CELLS, scored
from rig.blind.store import Store, version_of_diagnosis

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
"""Cases of each lane; an effect, form or noise in turn."""
QUICK = 6.0
"""s that a case of the set took at most in the proof; where an effect has none so quick, its quickest."""
LIMIT = 120.0
"""s of CPU for one diagnosis; a longer one has failed."""
ASKED = {
    "select.SCREENING_FALSE_ALARM": "what may be found at all",
    "select.KEPT_TERM_FALSE_ALARM": "what stays in the model",
    "select.PLAIN_DIRECTION_SIGMA": "what is no noise when the noise is estimated",
    "select.HIDDEN_TERM_PRICE": "what is told from slow noise",
    "select.HIDDEN_OFFSET_PRICE": "most false alarms are jumps of the zero",
    "select.NEXT_TERM_SHAPE_ERROR": "what a found term leaves for the next",
    "select.SHAPE_ERROR": "what a found term leaves that is called unexplained",
    "select.RIVALS_EQUAL_BIC": "explained or ambiguous",
    "select.RIVAL_STATED_BIC": "which rivals are stated",
    "select.PRESSED_TERM_HANDICAP": "which of two names where one ends at what is possible",
    "estimate.PRESSED_AT_BOUND_SIGMA": "when a value is not possible",
    "locate.RESIDUAL_FALSE_ALARM": "adequate or unexplained",
    "locate.PLAIN_STRUCTURE_P": "jumps and pulses that no smooth shape follows",
    "name.PART_DIFFERENCE": "when a parameter is not the same everywhere",
    "name.INCONSTANT_P": "the same, by chance",
    "name.OWN_COVARIATE_P": "when a shape is not the textbook's",
    "name.REPAIR_SHARE": "when two shapes only repair each other",
    "validate.PREDICTED_WORSE_CHI2": "when prediction doubts a name",
    "periodic.LINE_FALSE_ALARM": "lines that are taken out before all else",
    "estimate.LONGEST_NOISE_SCALE": "what is a drift and no noise",
}
"""The twenty of the most consequence, each with what it decides."""
AT_VALUE = "at its value"
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Setting:
    """One threshold moved, or none."""

    threshold: str
    factor: float

    @property
    def id(self) -> str:
        return f"{self.threshold} x {self.factor:g}" if self.threshold else AT_VALUE

    @property
    def values(self) -> dict[str, float]:
        known = dict(policy.thresholds())
        return {self.threshold: self.factor * known[self.threshold]} if self.threshold else {}


def settings(only: Sequence[str] = ()) -> list[Setting]:
    asked = [name for name in ASKED if not only or name in only]
    return [Setting("", 1.0), *(Setting(name, factor) for name in asked for factor in (0.5, 2.0))]


def overdue(*_: object) -> None:
    raise TimeoutError(f"took more than {LIMIT:g} s of CPU")


@dataclass(frozen=True, slots=True)
class Answered:
    """A case at one setting."""

    answer: Row

    @property
    def told(self) -> Row:
        """What it says, without how long it took."""
        return {key: value for key, value in self.answer.items() if key != "seconds"}


def _answered(folder: Path, without: Sequence[str], setting: Setting) -> Answered:
    signal.setitimer(signal.ITIMER_PROF, LIMIT)
    try:
        with policy.overridden(setting.values):
            answer, _ = answered(folder, tuple(without))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return Answered(answer)


def _watching(folder: Path, without: Sequence[str], asked: Sequence[Setting]) -> tuple[set[str], Answered]:
    """The settings that may turn a comparison, and the answer at the values themselves."""
    moved: dict[str, dict[str, float]] = defaultdict(dict)
    for setting in asked[1:]:
        moved[setting.threshold][setting.id] = setting.values[setting.threshold]
    plain = _answered(folder, without, asked[0])
    with watched(moved) as turned:
        again = _answered(folder, without, asked[0])
    return (turned if again.told == plain.told else {s.id for s in asked}), plain


def _row(case: str, setting: Setting, version: str, score: Any, *, same: bool) -> Row:
    row = {"case": case, "setting": setting.id, "version": version, "said": score.said, "named": score.named}
    row |= {"right": score.right, "alone": score.alone, "wrong": score.wrong, "counted": score.counted}
    outcome = score.outcome if score.order.cell in OPEN_CELLS else ""
    return {**row, "outcome": outcome, "failed": score.failed, "seconds": round(score.seconds, 2), "same": same}


def judged(
    case: str, ids: Sequence[str], only: Sequence[str], version: str, root: Path, *, check: bool = False
) -> list[Row]:
    """The settings `ids` of one case, in this process; its recordings are made and deleted.

    Raises ValueError where with `check` an answer differs that was told to be the same.
    """
    (job,) = designed(20, [case], DRAW)
    (order,) = job.orders
    store = Store(root / sha256(case.encode()).hexdigest()[:12])
    world = [sys.executable, "-m", "sim_devices", "conceal", "-", str(store.root)]
    store.opened.mkdir(parents=True, exist_ok=True)
    subprocess.run(world, input=json.dumps(job.asked()) + "\n", text=True, check=True, capture_output=True, cwd=ROOT)
    signal.signal(signal.SIGPROF, overdue)
    out: list[Row] = []
    truth = store.truth(job)
    if truth is not None and not truth["error"]:
        folder = store.opened / job.token
        turned, base = _watching(folder, order.without, settings(only))
        for setting in settings(only):
            if setting.id not in ids:
                continue
            same = setting.id not in turned
            answer = base if same else _answered(folder, order.without, setting)
            if same and check and (found := _answered(folder, order.without, setting)).told != base.told:
                raise ValueError(f"{case}, {setting.id}: told to be the same, but {found.told} is not {base.told}")
            out.append(_row(case, setting, version, scored(order, truth, answer.answer), same=same))
    rmtree(store.root, ignore_errors=True)
    return out


def run(cases: Sequence[str], only: Sequence[str], out: Path, jobs: int, *, check: bool = False) -> None:
    """What is not in the file yet."""
    version = version_of_diagnosis()
    done: dict[str, set[str]] = defaultdict(set)
    for row in rows_of(out, version):
        done[row["case"]].add(row["setting"])
    wanted = [setting.id for setting in settings(only)]
    pending = {case: left for case in cases if (left := [i for i in wanted if i not in done[case]])}
    out.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(jobs) as pool, out.open("a", encoding="utf-8") as file:
        root = out.with_suffix("")
        asked = [pool.submit(judged, case, ids, only, version, root, check=check) for case, ids in pending.items()]
        for number, each in enumerate(as_completed(asked), 1):
            for row in each.result():
                file.write(json.dumps(row) + "\n")
            file.flush()
            print(f"{number} of {len(asked)} cases", file=sys.stderr)


def rows_of(path: Path, version: str) -> list[Row]:
    """Those by this version of the diagnosis; a line that was broken off is none."""
    found: list[Row] = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        if line.endswith("}"):
            found.append(json.loads(line))
    return [row for row in found if row["version"] == version]


def shares(rows: Sequence[Row]) -> dict[str, float]:
    """Per cent of the cases of which each is asked; what none is asked of is left out."""
    lane = [row["case"].split("/")[0] for row in rows]
    concealed = [row for row, cell in zip(rows, lane, strict=True) if cell not in (*OPEN_CELLS, "clean")]
    clean = [row for row, cell in zip(rows, lane, strict=True) if cell == "clean"]
    opened = [row for row, cell in zip(rows, lane, strict=True) if cell in OPEN_CELLS and row["counted"]]
    parts = {
        "right": [row["right"] for row in concealed],
        "alone": [row["alone"] for row in concealed],
        "wrong names": [row["wrong"] for row in concealed] + [row["outcome"] == "wrong name" for row in opened],
        "false alarms": [not row["right"] for row in clean],
        "unexplained": [row["said"] == "unexplained" for row in concealed],
        "open world located": [row["outcome"] in LOCATED for row in opened],
        "failed": [row["failed"] for row in rows],
    }
    return {what: 100 * sum(part) / len(part) for what, part in parts.items() if part}


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Markdown, of the cases that were answered at the value itself and at the setting; in brackets the difference."""
    by: dict[str, dict[str, Row]] = defaultdict(dict)
    for row in rows:
        by[row["setting"]][row["case"]] = row
    base, values = by[AT_VALUE], dict(policy.thresholds())
    heads = list(shares(list(base.values())))
    yield f"| threshold | at | {' | '.join(heads)} | answered otherwise |"
    yield f"|---|---|{'---|' * (len(heads) + 1)}"
    whole = shares(list(base.values()))
    yield f"| all at their values, {len(base)} cases | | {' | '.join(f'{whole[h]:.1f}' for h in heads)} | |"
    for setting in settings()[1:]:
        both = sorted(base.keys() & by[setting.id].keys())
        if both:
            before, after = (shares([part[case] for case in both]) for part in (base, by[setting.id]))
            told = " | ".join(f"{after[h]:.1f} ({after[h] - before[h]:+.1f})" if h in after else "" for h in heads)
            moved = values[setting.threshold].moved(setting.values[setting.threshold])
            other = sum(by[setting.id][case]["named"] != base[case]["named"] for case in both)
            other_said = sum(by[setting.id][case]["said"] != base[case]["said"] for case in both)
            now = f"{setting.threshold} ({values[setting.threshold]:g})"
            yield f"| {now} | {moved:g} | {told} | names {other}, verdict {other_said} of {len(both)} |"


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


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--out", type=Path, default=Path("build/sensitivity.jsonl"), help="JSON lines, gone on with")
    parser.add_argument("--cases", type=int, help="only so many, the first ones")
    parser.add_argument("--only", nargs="+", default=[], choices=list(ASKED), help="only these thresholds")
    parser.add_argument("--table", action="store_true", help="only tell what is in the file")
    parser.add_argument("--check", action="store_true", help="work out what is told to be the same, too")
    parser.add_argument("--choose", action="store_true", help=f"write {CASES.name} anew")
    asked = parser.parse_args(arguments)
    if asked.choose:
        CASES.write_text("\n".join(chosen()) + "\n", encoding="utf-8")
        return
    if not asked.table:
        run(
            CASES.read_text(encoding="utf-8").split()[: asked.cases],
            asked.only,
            asked.out,
            asked.jobs,
            check=asked.check,
        )
    print("\n".join(table(rows_of(asked.out, version_of_diagnosis()))))


if __name__ == "__main__":
    main(sys.argv[1:])
