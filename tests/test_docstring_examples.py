"""The examples in docstrings say what is so."""

from __future__ import annotations

import doctest
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("drivers", "identification", "rig", "sim_devices")


def _with_examples() -> list[str]:
    paths = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
    return [str(path.relative_to(ROOT)) for path in paths if ">>> " in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("path", _with_examples())
def test_examples(path):
    module = import_module(path.removesuffix("/__init__.py").removesuffix(".py").replace("/", "."))
    failed, tried = doctest.testmod(module)
    assert tried > 0, f"{path} has examples that nobody finds"
    assert failed == 0
