"""Who names what a model leaves out? PySINDy, SysIdentPy, stepwise regression with HAC errors, and `rig diagnose`.

    python -m venv build/peers-venv; build/peers-venv/bin/pip install -e '.[benchmark]'     SysIdentPy wants numpy < 2.4
    build/peers-venv/bin/python benchmarks/peers.py N          N recordings of each kind; resumes from build/peers.jsonl
    build/peers-venv/bin/python benchmarks/peers.py N --json FILE     the figures for `rig prove --beside`
    build/peers-venv/bin/python benchmarks/peers.py tune N     every setting of every grid on N recordings of each kind

Kinds: clean, one effect at 15 sigma (clear), one effect at 40 sigma (plain); effects in turn, all else drawn at random
by `sim_devices.concealed`. Every method gets the same recording, as our own candidate columns (`peers.columns`), and
names the effects whose columns it keeps; it never sees the truth, which is put beside the answers at the end. Ours gets
the recording itself. The settings of the peers (`peers.methods.TUNED`) are the best of their grids on seeds of their
own: most recordings right, clean ones counted like the others.

Right alone: the effect and nothing else. Right among: the effect and others; for ours also as a stated rival.
Wrong: names without the effect. None: no name, though there is an effect. False alarm: any name on a clean recording.
Error: rms on another recording of the same thruster with another plan, over that of its noise; kept columns and C by
least squares on the first recording, the tare from the second; of ours the model that it found, without a look at the
other recording's thrust. Seconds: the method, without making the columns.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import asdict
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from time import process_time
from typing import Any

os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"))  # before numpy

import numpy as np
from peers.cases import EFFECTS, STRENGTHS, Puzzle, made
from peers.columns import Problem, problem
from peers.counting import Answer, counted, table
from peers.methods import GRIDS, TUNED, names

from identification.mismatch.compare.simulation import Drive, Prediction, others_of, simulate
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from identification.recording import Recording
from rig.blind.beside import Peers, write
from rig.blind.store import version_of_diagnosis
from sim_devices.concealed.version import version as version_of_world

OURS = "rig diagnose"
BARE = "C V|V| alone"
STORE = Path(__file__).parents[1] / "build" / "peers.jsonl"
FIRST_SEED = 1000
FIRST_TUNING_SEED = 50_000
PACKAGES = ("pysindy", "sysidentpy", "statsmodels", "numpy")
CODE = f"{version_of_diagnosis()} in world {version_of_world()}"
COLUMNS = sha256(b"".join(p.read_bytes() for p in sorted((Path(__file__).parent / "peers").glob("*.py")))).hexdigest()


def code_of(method: str) -> str:
    """What an answer goes with: those of the peers with the columns that they are given, too."""
    return CODE if method == OURS else f"{CODE}, columns {COLUMNS[:12]}"


def drawn(number: int, first: int) -> Iterator[tuple[str, str, int]]:
    """(kind, effect, seed), the kinds in turn."""
    order = np.random.default_rng(first).permutation(EFFECTS)
    for i in range(number):
        for j, kind in enumerate(STRENGTHS):
            yield kind, "" if kind == "clean" else str(order[(i + 13 * (j - 1)) % order.size]), first + 10 * i + j


def ours(puzzle: Puzzle) -> tuple[tuple[str, ...], tuple[str, ...], float]:
    found = diagnose([puzzle.fitted])
    assert isinstance(found, Diagnosis)
    named = tuple(f.effect for f in found.findings)
    rivals = tuple(r.effect for f in found.findings for r in f.rivals if r.effect not in named)
    return named, rivals, error_of(found, puzzle.unseen)


def error_of(found: Diagnosis, unseen: Recording) -> float:
    """N rms per sample of the model found, its tare by the unseen recording."""
    command, thrust = unseen.first_of("command_voltage"), unseen.first_of("thrust")
    assert found.twin is not None
    assert command is not None
    assert thrust is not None
    model = simulate(found.twin, Drive(command.time, command.value, others=others_of(unseen)), thrust.time)
    assert isinstance(model, Prediction)
    return float(np.std(thrust.value - model.thrust))


def answered(kind: str, effect: str, seed: int, methods: set[str]) -> Iterator[Answer]:
    if not methods:
        return
    puzzle, truth = made(kind, effect, seed)
    if OURS in methods:
        began = process_time()
        named, rivals, error = ours(puzzle)
        took = process_time() - began
        yield Answer(OURS, kind, effect, seed, named, rivals, error / truth.noise, took, code=CODE)
    if methods == {OURS}:
        return
    p = problem(puzzle)
    if BARE in methods:
        yield Answer(BARE, kind, effect, seed, (), (), p.held_out([]) / truth.noise, 0.0, code=code_of(BARE))
    for method in methods & set(TUNED):
        yield _answer(method, p, TUNED[method], kind, effect, seed, truth.noise)


def _answer(
    method: str, p: Problem, setting: dict[str, Any], kind: str, effect: str, seed: int, noise: float
) -> Answer:
    began = process_time()
    named, kept = names(p, method, setting)
    took = process_time() - began
    error = p.held_out(kept) / noise
    return Answer(method, kind, effect, seed, tuple(sorted(named)), (), error, took, setting, code_of(method))


def kept_answers() -> list[Answer]:
    """By this code and at these settings; a line that was cut off is none."""
    if not STORE.exists():
        return []
    found = (_answer_in(line) for line in STORE.read_text(encoding="utf-8").splitlines())
    answers = [a for a in found if a is not None]
    return [a for a in answers if a.code == code_of(a.method) and a.setting == TUNED.get(a.method, {})]


def _answer_in(line: str) -> Answer | None:
    try:
        told = json.loads(line)
    except ValueError:
        return None
    return Answer(**{**told, "named": tuple(told["named"]), "rivals": tuple(told["rivals"])})


def run(number: int) -> list[Answer]:
    STORE.parent.mkdir(exist_ok=True)
    answers = kept_answers()
    done = {(a.kind, a.effect, a.seed, a.method) for a in answers}
    cut = STORE.exists() and not STORE.read_bytes().endswith(b"\n")
    with STORE.open("a", encoding="utf-8") as store:
        store.write("\n" * cut)
        for one in drawn(number, FIRST_SEED):
            new = list(answered(*one, {m for m in (OURS, BARE, *TUNED) if (*one, m) not in done}))
            store.writelines(json.dumps(asdict(a)) + "\n" for a in new)
            store.flush()
            answers += new
            print(*one, "; ".join(f"{a.method} {a.outcome}" for a in new), file=sys.stderr)
    wanted = set(drawn(number, FIRST_SEED))
    return [a for a in answers if (a.kind, a.effect, a.seed) in wanted]


def figures(answers: list[Answer], each: int) -> Peers:
    found = counted(answers, (OURS, *TUNED, BARE), STRENGTHS, BARE)
    packages = {name: version(name) for name in PACKAGES}
    return Peers(version_of_diagnosis(), version_of_world(), FIRST_SEED, each, packages, found)


def tune(number: int) -> None:
    """How many of the recordings each setting has right: alone, or quiet on a clean one."""
    right: dict[tuple[str, str], list[bool]] = {}
    for kind, effect, seed in drawn(number, FIRST_TUNING_SEED):
        puzzle, truth = made(kind, effect, seed)
        p = problem(puzzle)
        for method, grid in GRIDS.items():
            for setting in grid:
                a = _answer(method, p, setting, kind, effect, seed, truth.noise)
                right.setdefault((method, json.dumps(setting)), []).append(a.outcome in ("alone", "quiet"))
        print(f"{kind} {effect} {seed}", file=sys.stderr)
        if kind == "plain":
            _tuned_so_far(right)


def _tuned_so_far(right: dict[tuple[str, str], list[bool]]) -> None:
    for (method, setting), found in sorted(right.items(), key=lambda each: (each[0][0], -sum(each[1]))):
        print(f"| {method} | {setting} | {sum(found)} of {len(found)} |")
    print(flush=True)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("what", nargs="*", metavar="[tune] N", help="recordings of each kind (default 5)")
    options.add_argument("--json", type=Path, metavar="FILE", help="write the figures here, for `rig prove --beside`")
    given = options.parse_args()
    tuning = given.what[:1] == ["tune"]
    each = int(given.what[tuning]) if given.what[tuning:] else 5
    if tuning:
        tune(each)
        return
    found = figures(run(each), each)
    print(table(found.methods))
    if given.json is not None:
        write(given.json, found)


if __name__ == "__main__":
    main()
