"""A campaign that is killed again and again and gone on with, and what came of it beside one that was left alone."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from rig.campaign.plan import Plan
from rig.fit.answer import fit_recordings
from rig.hdf5 import load
from rig.recording.ledger import read
from tests.rig.operate.killed_campaign import LONG, PLAN, THRUSTERS

PROJECT = Path(__file__).parents[3]
Result = tuple[str, int, str, float]
"""Thruster, index, phase and voltage of a step that was measured."""


@dataclass(frozen=True)
class Came:
    """What a campaign has measured."""

    ended: tuple[str, ...]
    """`killed` or the outcome, of each part."""
    results: Counter[Result]
    """How often each step of the plan was measured whole."""
    C: dict[str, tuple[float, float]]
    """N/V^2 and its standard deviation, of each thruster by all its recordings."""
    files: int
    attempts: tuple[int, ...]
    """Of all recordings, thruster by thruster."""


def campaign(folder: Path, kills: int, seed: int, most: float, *, long: bool = False) -> Came:
    """`kills` kills, each after at most `most` s of its part, then to the end."""
    folder.mkdir(parents=True)
    chance, plan = random.Random(seed), LONG if long else PLAN
    words = [sys.executable, "-m", "tests.rig.operate.killed_campaign", str(folder), *(["long"] if long else [])]
    ended: list[str] = []
    with subprocess.Popen(
        words, cwd=PROJECT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        while not ended or (ended[-1] == "killed" and len(ended) <= kills):
            process.stdin.write(f"{chance.uniform(0.0, most) if len(ended) < kills else 'inf'}\n")
            ended.append(process.stdout.readline().strip())
        process.stdin.close()
    return _came(folder, plan, tuple(ended))


def _came(folder: Path, plan: Plan, ended: tuple[str, ...]) -> Came:
    results: Counter[Result] = Counter()
    C, attempts = {}, list[int]()
    planned = {(step.index, step.phase): step for step in plan}
    runs = [fact for fact in read(folder) if fact["fact"] == "run_start"]
    for thruster in THRUSTERS:
        parts = [load(Path(run["recording"])) for run in runs if run["thruster"] == thruster]
        attempts += [int(str(part.attributes["attempt"])) for part in parts]
        for row in (row for part in parts for row in part.steps):
            step = planned.get((row.index, row.phase))
            if step is not None and step.measures:
                results[thruster, row.index, row.phase, row.command_voltage] += 1
        moved = [part for part in parts if any(row.phase == "hold" for row in part.steps)]
        if moved:
            (answer,) = fit_recordings(moved)
            C[thruster] = (answer.fit.parameters["C"].value, answer.fit.parameters["C"].std)
    return Came(ended, results, C, len(runs), tuple(attempts))


def told(came: Came) -> str:
    """One line of JSON."""
    kinds = Counter(came.results.values())
    return json.dumps(
        {
            "kills": came.ended.count("killed"), "ended": came.ended[-1], "recordings": came.files,
            "measured": len(came.results), "twice": sum(count for times, count in kinds.items() if times > 1),
            "C": {name: round(value, 5) for name, (value, _) in came.C.items()},
        }
    )  # fmt: skip
