"""Would a test notice? Mutants of what stops a motor, each run against the tests of its room.

    python benchmarks/controller/mutation.py [guard|proof|sequencer|loop|arming ...] [--only LINE ...] [--every N]

A mutant is the module with one change: a comparison moved or turned, an operator exchanged, a number one larger, a
condition turned or left out, a statement left out, a return without its value. Texts, type annotations and decorators
are left alone. Each is run in a process of its own, `LIMIT` s of a processor at most (a mutant that hangs is killed
too); the first test that fails kills it. Prints the survivors with their lines, then how many were made and killed.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import copy
import importlib
import io
import os
import signal
import sys
import types
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

PROJECT = Path(__file__).resolve().parents[2]
LIMIT = 120
"""s of a processor: beside other work a mutant gets as much as alone."""
HANGS = 900
"""s by the clock, for one that waits and computes nothing."""
STAGES = ("test_arming.py", "test_campaign_stops.py", "test_campaign_failures.py")
PROOFS = ("tests/rig/safety/test_proof_edges.py", "tests/rig/sequence/test_sequencer_proof.py")
TARGETS: dict[str, tuple[str, tuple[str, ...]]] = {
    "guard": ("rig/safety/guard.py", ("tests/rig/safety/test_guard_edges.py", "tests/rig/safety/test_guard.py")),
    "proof": (
        "rig/safety/watchdog_proof.py",
        ("tests/rig/safety/test_proof_edges.py", "tests/rig/sequence/test_sequencer_proof.py"),
    ),
    "sequencer": ("rig/sequence/sequencer.py", ("tests/rig/sequence",)),
    "loop": ("rig/control/loop.py", ("tests/rig/control", "tests/rig/stages/test_campaign_failures.py")),
    "arming": ("rig/stages/arming.py", tuple(f"tests/rig/stages/{name}" for name in STAGES)),
}
"""Module, and the tests that are to notice, the quickest first."""
COMPARED: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
CALCULATED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}
HEAVY = ("numpy", "scipy.stats", "h5py", "pydantic", "pytest", "serial", "can")
"""Imported once, before the processes part."""


class Mutant(NamedTuple):
    line: int
    what: str
    source: str


def changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """What may stand in the place of a node."""
    match node:
        case ast.Compare(ops=[op]):
            for other in COMPARED[type(op)]:
                yield other.__name__, ast.Compare(node.left, [other()], node.comparators)
        case ast.BoolOp(op=op):
            yield "and/or", ast.BoolOp(ast.And() if isinstance(op, ast.Or) else ast.Or(), node.values)
            for i in range(len(node.values)):
                left = [value for j, value in enumerate(node.values) if j != i]
                yield f"without operand {i + 1}", left[0] if len(left) == 1 else ast.BoolOp(op, left)
        case ast.UnaryOp(op=ast.Not()):
            yield "without not", node.operand
        case ast.BinOp(op=op) if type(op) in CALCULATED:
            yield CALCULATED[type(op)].__name__, ast.BinOp(node.left, CALCULATED[type(op)](), node.right)
        case ast.Constant(value=bool(value)):
            yield str(not value), ast.Constant(not value)
        case ast.Constant(value=int(value) | float(value)):
            yield f"{value} + 1", ast.Constant(value + 1)
        case ast.IfExp():
            yield "condition turned", ast.IfExp(ast.UnaryOp(ast.Not(), node.test), node.body, node.orelse)
        case ast.stmt():
            yield from _changed_statements(node)


def _changed_statements(node: ast.stmt) -> Iterator[tuple[str, ast.AST]]:
    match node:
        case ast.If() | ast.While():
            yield "condition turned", _with_test(node)
        case ast.Return(value=value) if value is not None and not _is_none(value):
            yield "return None", ast.Return(ast.Constant(None))
        case ast.Assign(value=ast.Subscript(value=ast.Name(id="Literal"))):
            return  # the name of a type
        case ast.Expr(value=ast.Call()) | ast.Assign() | ast.AugAssign() | ast.Raise():
            yield "left out", ast.Pass()


def _with_test(node: ast.If | ast.While) -> ast.AST:
    changed = copy.copy(node)
    changed.test = ast.UnaryOp(ast.Not(), node.test)
    return changed


def _is_none(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


SKIPPED = {"annotation", "returns", "decorator_list", "bases"}


def places(node: ast.AST) -> Iterator[tuple[ast.AST, str, int | None]]:
    """(parent, field, index) of every node that may be exchanged; no text that is made of pieces, no annotation."""
    for field, value in ast.iter_fields(node):
        if field in SKIPPED or isinstance(node, ast.JoinedStr):
            continue
        for index, child in enumerate(value) if isinstance(value, list) else ((None, value),):
            if isinstance(child, ast.AST):
                yield node, field, index
                yield from places(child)


def mutants(source: str) -> Iterator[Mutant]:
    tree = ast.parse(source)
    for parent, field, index in list(places(tree)):
        held = getattr(parent, field)
        node = held if index is None else held[index]
        for what, other in changes(node):
            put = other
            if index is None:
                setattr(parent, field, put)
            else:
                held[index] = put
            yield Mutant(getattr(node, "lineno", 0), what, ast.unparse(ast.fix_missing_locations(tree)))
            if index is None:
                setattr(parent, field, node)
            else:
                held[index] = node


def exchange(module: str, source: str) -> None:
    """From now on this process imports that module with another source."""
    name = module.removesuffix(".py").replace("/", ".")
    package, _, last = name.rpartition(".")
    made = types.ModuleType(name)
    made.__file__, made.__package__ = str(PROJECT / module), package
    sys.modules[name] = made
    exec(compile(source, made.__file__, "exec"), made.__dict__)
    setattr(importlib.import_module(package), last, made)


def survives(module: str, source: str, tests: tuple[str, ...]) -> bool:
    """Do all tests pass? In a child, whose every word is thrown away."""
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(HANGS)
        signal.setitimer(signal.ITIMER_PROF, LIMIT)
        status = 1
        with contextlib.suppress(BaseException):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
            exchange(module, source)
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                import pytest

                status = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]))
        os._exit(0 if status == 0 else 1)
    return os.waitpid(child, 0)[1] == 0


def tried(name: str, only: Sequence[int], every: int) -> tuple[int, int]:
    """Mutants made and killed."""
    module, tests = TARGETS[name]
    source = (PROJECT / module).read_text(encoding="utf-8")
    there = tuple(test for test in tests if (PROJECT / test).exists())
    if not survives(module, ast.unparse(ast.parse(source)), there):
        raise SystemExit(f"{module}: its tests fail without any change; mend that first")
    made = killed = 0
    lines = source.splitlines()
    wanted = [mutant for mutant in mutants(source) if not only or mutant.line in only]
    for mutant in wanted[::every]:
        made += 1
        if survives(module, mutant.source, there):
            print(f"  {module}:{mutant.line}: {mutant.what}: {lines[mutant.line - 1].strip()}", flush=True)
        else:
            killed += 1
    print(f"{module}: {made} mutants, {killed} killed, {made - killed} survived", flush=True)
    return made, killed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="|".join(TARGETS))
    parser.add_argument("--only", type=int, nargs="+", default=(), help="the mutants of these lines")
    parser.add_argument("--every", type=int, default=1, help="each so manieth mutant alone")
    asked = parser.parse_args()
    os.chdir(PROJECT)
    sys.path.insert(0, str(PROJECT))
    for heavy in HEAVY:
        importlib.import_module(heavy)
    found = [tried(name, asked.only, asked.every) for name in asked.names or TARGETS]
    made, killed = (sum(each) for each in zip(*found, strict=True))
    print(f"together: {made} mutants, {killed} killed, {made - killed} survived")
    return 0


if __name__ == "__main__":
    sys.exit(main())
