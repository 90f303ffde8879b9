"""Answers of a sensitivity run, one JSON line per case: what is there is not worked out again.

A line holds the case, the version of the diagnosis, the answer at the values themselves, and what is otherwise in it at
each setting at which anything is. The version is of the code that a diagnosis of a thruster runs, without its texts: a
comment, a docstring, a reason of a threshold, or another part of the repository leaves it as it is.
"""

from __future__ import annotations

import ast
import gzip
import json
import sys
from collections.abc import Collection, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import rig.blind.answering  # noqa: F401  # all that a diagnosis of a thruster imports

TEXTS = frozenset({"unit", "reason", "evidence"})
"""Arguments of a threshold that decide nothing."""
Row = dict[str, Any]


class _Acting(ast.NodeTransformer):
    """What of a module acts: no text that is an expression by itself, nor one that says why a threshold is."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        return None if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if isinstance(node.func, ast.Name) and node.func.id in ("Threshold", "Count"):
            node.keywords = [each for each in node.keywords if each.arg not in TEXTS]
        return self.generic_visit(node)


def version() -> str:
    """Changes with what a diagnosis of a thruster does; the vehicle's is imported only where there is a vehicle."""
    found = sha256()
    loaded = {name: module.__file__ for name, module in sys.modules.items() if name.startswith("identification.")}
    for name, file in sorted(loaded.items()):
        if file is not None and "vehicle" not in name:
            found.update(name.encode())
            found.update(ast.dump(_Acting().visit(ast.parse(Path(file).read_bytes()))).encode())
    return found.hexdigest()[:12]


def line(case: str, code: str, rows: Mapping[str, Row], base: str, seconds: Mapping[str, float]) -> str:
    """`rows`: setting -> answer, `base` the one at the values themselves; `seconds`: what each cost, s of CPU."""
    first = rows.get(base, {})
    otherwise = {each: {k: v for k, v in row.items() if v != first[k]} for each, row in rows.items() if row != first}
    cost = {each: round(s, 2) for each, s in seconds.items() if s}
    told = {"case": case, "version": code, "settings": sorted(rows), "at": first, "otherwise": otherwise, "cpu": cost}
    return json.dumps(told) + "\n"


def known(path: Path, versions: Collection[str]) -> dict[str, dict[str, Row]]:
    """Case -> setting -> answer, by these versions; of two the later counts."""
    found: dict[str, dict[str, Row]] = {}
    for row in rows_of(path):
        if row["version"] in versions:
            rows = {each: row["at"] | row["otherwise"].get(each, {}) for each in row["settings"]}
            found.setdefault(row["case"], {}).update(rows)
    return found


def rows_of(path: Path) -> list[Row]:
    """What is in the file, packed by gzip or not; a line that was broken off is none."""
    if not path.exists():
        return []
    packed = path.read_bytes()
    text = (gzip.decompress(packed) if path.suffix == ".gz" else packed).decode("utf-8")
    return [json.loads(each) for each in text.splitlines() if each.endswith("}")]


def costs(path: Path, versions: Collection[str]) -> list[float]:
    """s of CPU of each case."""
    return [sum(row["cpu"].values()) for row in rows_of(path) if row["version"] in versions]
