"""`rig prove`: the blind proof of the diagnosis, end to end."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.blind.progress import shown
from rig.errors import RigError
from rig.result_path import RESULT_FILE, require_different
from rig.workers.interrupting import interruptible

if TYPE_CHECKING:
    from rig.blind.beside import Beside
    from rig.blind.collecting import Collected
    from rig.blind.design import Job
    from rig.blind.scoring.score import Score
    from rig.blind.store import Store

STORE = Path("build/prove")
LONGEST = 86400.0
"""s that a diagnosis may be given."""


def designed(seeds: int, only: Sequence[str], draw: str = "") -> list[Job]:
    """The jobs of a proof of everything that the world conceals. Raises ProofError when nothing is asked."""
    from identification.physics.catalogue import CATALOGUE
    from rig.blind.design import NOT_REMOVABLE, design
    from rig.blind.store import ProofError
    from rig.blind.workers import concealable

    jobs = design(concealable(), {term.id for term in CATALOGUE} | NOT_REMOVABLE, seeds, only, draw)
    if not jobs:
        raise ProofError(
            f"no case is called {', '.join(only)}; expected cell/effect, as plain/heating, clean, removed/*"
        )
    return jobs


def run(store: Store, jobs: Sequence[Job], lanes: int, limit: float, *, renew: bool, keep: bool) -> None:
    """Do what is not done yet. Raises ProofError."""
    from rig.blind.store import version_of_diagnosis
    from rig.blind.workers import Lane, carry_out

    code = version_of_diagnosis()
    pending = [job for job in jobs if store.pending(job, code if renew else "", limit)]
    if not pending:
        return
    working = [Lane(store, str(i), limit, code, keep) for i in range(min(lanes, len(pending)))]
    with store.locked(), interruptible(), shown(len(pending)) as told:
        carry_out(pending, working, renew, told)


def summary(found: Collected) -> str:
    """The goals, as a person reads them in a terminal."""
    from rig.blind.scoring.metrics import besides, goals

    sign = {"yes": "ok    ", "reached": "ok ?  ", "open": "open  ", "no": "MISSED", "": "      "}
    rows = [
        f"{sign[g.met]}  {g.what}: {g.measured}"
        + (f" ({g.interval})" if g.interval else "")
        + f", n = {g.n}"
        + (f", goal {g.wanted}" if g.wanted else "")
        for g in (*goals(found.scores), *(g for g in besides(found.scores) if g.n))
    ]
    if len(found.versions) > 1:
        rows.append(f"answered by {len(found.versions)} versions of the diagnosis: {', '.join(found.versions)}")
    failed = sum(s.failed for s in found.scores)
    tail = f"{len(found.scores)} answers, {failed} of them crashed, refused or overdue; {found.missing} still to come"
    return "\n".join([*rows, f"{tail}; {len(found.undrawn)} cases could not be drawn"])


def still_wrong(found: Collected) -> str:
    """What is not good, a line each: of cases that all had come out wrong, so no rates."""
    from rig.blind.scoring.tables import said

    rows = [json.dumps({k: v for k, v in said(s).items() if v}) for s in found.scores if not s.good]
    return "\n".join([*rows, f"{len(found.scores) - len(rows)} of {len(found.scores)} came out right this time"])


def require_limit(limit: float) -> None:
    """Raises ProofError; click lets NaN through every range."""
    from rig.blind.store import ProofError

    if not 0.0 < limit <= LONGEST:
        raise ProofError(f"--limit must be above 0 s and at most {LONGEST:g} s, but is {limit:g} s")


def read_beside(paths: Sequence[Path], *, shown: bool) -> list[Beside]:
    """What the page and the JSON show besides the proof, if they are wanted. Raises ProofError."""
    from rig.blind.beside import read
    from rig.blind.store import ProofError

    if paths and not shown:
        raise ProofError("--beside is for the page and the JSON, and neither is asked for; give --report or --json too")
    return [read(path) for path in paths]


def leave(
    found: Collected, seeds: int, draw: str, beside: Sequence[Beside], json_path: Path | None, report: Path | None
) -> None:
    """Write figures and page where they are wanted. Raises OSError."""
    from rig.blind.beside import beside_json
    from rig.blind.scoring.tables import tables

    figures = tables(found.scores, seeds, found.versions, found.undrawn, draw) | beside_json(beside)
    if json_path is not None:
        json_path.parent.mkdir(parents=True, exist_ok=True)
        json_path.write_text(json.dumps(figures, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    if report is not None:
        from rig.blind.report.page import proof_page
        from rig.report.page import write

        write(proof_page(found, figures, beside), report)


def one_case(name: str, draw: str, limit: float, *, verbose: bool) -> str:
    """Make and answer one order anew, and tell truth and answer. Raises ProofError."""
    from rig.blind.store import Store

    store = Store(STORE.with_name("prove-case"))
    number = name.rsplit("/", 1)[-1]
    jobs = designed(int(number) + 1 if number.isdecimal() else 1, [name], draw)
    for job in jobs:
        store.forget(job)
    run(store, jobs, 1, limit, renew=True, keep=True)
    return "\n\n".join(_told(store, job, verbose=verbose) for job in jobs)


def _counted(score: Score) -> str:
    """How the answer counts in its cell."""
    from rig.blind.scoring.score import OPEN_CELLS

    if score.order.cell in OPEN_CELLS:
        return f"outcome: {score.outcome}" + ("" if score.counted else " (not counted: a neighbour is too near)")
    if score.order.cell in ("field", "difference"):
        return f"as it should be: {score.good}, exact: {score.exact}, a name that is not there: {score.extra}"
    return f"right: {score.right}, alone: {score.alone}, wrong: {score.wrong}"


def _told(store: Store, job: Job, *, verbose: bool) -> str:
    from rig.blind.collecting import collected
    from rig.blind.scoring.tables import said

    truth = store.truth(job)
    assert truth is not None
    if truth["error"]:
        return f"{job.id}: {truth['error']}"
    rows = [job.id, f"recordings: {store.opened / job.token} (rig.blind.reading.recordings reads them)"]
    shown = ("effects", "known", "fault", "noise_kind", "plan", "rate", "channels")
    short = {name: truth[name] for name in shown if name in truth}
    rows.append(f"truth: {json.dumps(truth if verbose else short)}")
    for order, score in zip(job.orders, collected(store, [job]).scores, strict=True):
        rows += [f"{order.id}: {json.dumps(said(score))}", _counted(score)]
        answer = store.answer(job, order)
        if verbose or score.failed:
            rows.append(json.dumps(answer, indent=1))
    return "\n".join(rows)


@click.command("prove")
@click.option("--seeds", type=click.IntRange(min=1), default=20, show_default=True, help="Cases of each cell.")
@click.option(
    "--only", multiple=True, metavar="CELL/EFFECT", help="Only these cells, as plain/heating, removed, */dead_band."
)
@click.option(
    "--draw", default="", metavar="TEXT", help="Other cases: those of no draw are what the diagnosis was developed on."
)
@click.option("--jobs", "lanes", type=click.IntRange(min=1), help="Cases at a time.  [default: one per core]")
@click.option(
    "--store",
    type=click.Path(file_okay=False, path_type=Path),
    default=STORE,
    show_default=True,
    help="Folder of truths and answers; a proof that was broken off goes on there.",
)
@click.option(
    "--limit",
    type=float,
    default=300.0,
    show_default=True,
    metavar="S",
    help="Longest diagnosis; a longer one has failed.",
)
@click.option("--renew", is_flag=True, help="Answer again what another version of the diagnosis answered.")
@click.option("--failures", is_flag=True, help="Only what came out wrong by another version of the diagnosis: again.")
@click.option(
    "--scores",
    "scores_path",
    type=RESULT_FILE,
    help="File of scores: what it holds by this version of the diagnosis is not asked again; all are written to it.",
)
@click.option(
    "--beside",
    "beside_paths",
    type=click.Path(dir_okay=False, path_type=Path),
    multiple=True,
    metavar="FILE",
    help="Show this on the page and in the JSON too: what benchmarks/peers.py or an example with real recordings "
    "wrote with --json (may be repeated).",
)
@click.option("--keep", is_flag=True, help="Keep the recordings (some 5 MB each).")
@click.option("--no-run", is_flag=True, help="Only tell what is in the store.")
@click.option("--case", metavar="CELL/EFFECT/NUMBER", help="Make and answer this one case, print truth and answer.")
@click.option("--verbose", is_flag=True, help="With --case: everything.")
@click.option("--report", type=RESULT_FILE, help="Write a page with figures here (HTML).")
@click.option("--json", "json_path", type=RESULT_FILE, help="Write the figures here.")
def prove_command(
    seeds: int,
    only: tuple[str, ...],
    draw: str,
    lanes: int | None,
    store: Path,
    limit: float,
    renew: bool,
    failures: bool,
    scores_path: Path | None,
    beside_paths: tuple[Path, ...],
    keep: bool,
    no_run: bool,
    case: str | None,
    verbose: bool,
    report: Path | None,
    json_path: Path | None,
) -> None:
    """Prove the diagnosis on recordings in which the simulated world concealed physics.

    Exit status 0 whatever the figures are, 2 when the proof cannot be run.
    """
    from rig.blind import score_file
    from rig.blind.collecting import collected, not_good
    from rig.blind.store import Store, version_of_diagnosis

    try:
        require_limit(limit)
        outputs = (("--json", json_path), ("--report", report), ("--scores", scores_path))
        require_different(*(("--beside", path) for path in beside_paths), *outputs)
        beside = read_beside(beside_paths, shown=bool(report or json_path))
        if case is not None:
            click.echo(one_case(case, draw, limit, verbose=verbose))
            return
        kept, jobs = Store(store), designed(seeds, only, draw)
        told, version = score_file.read(scores_path) if scores_path is not None else [], version_of_diagnosis()
        known = score_file.usable(told, jobs, version, others=no_run)
        if failures:
            so_far = score_file.usable(told, jobs, version, others=True)
            jobs, renew = not_good(collected(kept, jobs, so_far, version), jobs), True
        if not no_run:
            pending = score_file.unanswered(jobs, known)
            run(kept, pending, lanes or os.cpu_count() or 1, limit, renew=renew, keep=keep)
        found = collected(kept, jobs, known, version)
        if scores_path is not None:
            score_file.add(scores_path, found.known)
        click.echo(still_wrong(found) if failures else summary(found))
        leave(found, seeds, draw, beside, json_path, report)
    except (RigError, OSError) as error:
        click.echo(f"rig prove: {error}", err=True)
        raise SystemExit(2) from error
