"""Names and values that each subset of the runs of one thruster gives, side by side: does a name come and go?

    python examples/real_subsets.py [FOLDER] [--only NAME]

FOLDER as of real_diagnosis.py, whose cases of several runs these are. Every run, every pair, all together: a row each
with the verdict, the named effects and their values with standard errors.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from itertools import chain, combinations
from pathlib import Path

import click
from real_diagnosis import CASES, HERE, Case, imported

from identification.mismatch.diagnosis import Diagnosis, Finding
from rig.diagnose.command import diagnose_files

SEVERAL = ("tank forward-reverse", "stand, voltage sine")


def subsets(files: Sequence[Path]) -> Iterator[tuple[Path, ...]]:
    """Each that is not empty, the single ones first."""
    return chain.from_iterable(combinations(files, many) for many in range(1, len(files) + 1))


def values(finding: Finding) -> str:
    """As one clause."""
    form = f" ({finding.form})" if finding.form else ""
    told = ", ".join(f"{name} {v.value:.3g} +- {v.std:.2g} {v.unit}" for name, v in finding.parameters.items())
    return f"{finding.effect}{form}: {told}"


def row(files: Sequence[Path], found: Diagnosis) -> str:
    """What one subset gives, the findings below each other."""
    held = found.heldout
    head = f"{' + '.join(p.stem for p in files)}: {found.verdict}, {held.before:.3g} -> {held.after:.3g} N"
    rivals = [f"      or {r.effect}" for f in found.findings for r in f.rivals]
    return "\n".join([head, *(f"    {values(f)}" for f in found.findings), *rivals])


def show(root: Path, case: Case) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        files = [
            path for pattern in (case.fitted, case.judged) for path in imported(root, case, pattern, Path(temporary))
        ]
        print(f"=== {case.name}: {len(files)} runs", flush=True)
        for some in subsets(sorted(files)):
            print(row(some, diagnose_files(some)), flush=True)


@click.command(help=__doc__)
@click.argument("root", metavar="FOLDER", type=click.Path(path_type=Path), default=HERE)
@click.option("--only", default="")
def main(root: Path, only: str) -> None:
    if not root.is_dir():
        print(f"{root} is not there; the real recordings are not part of the project")
        return
    for case in CASES:
        if case.name in SEVERAL and only in case.name:
            show(root, case)


if __name__ == "__main__":
    main()
