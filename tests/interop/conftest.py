"""Third-party programs: missing ones are skipped on a developer's machine, and fail where THRUSTER_RIG_CI is set."""

from __future__ import annotations

import importlib
import os

import pytest


@pytest.fixture
def third_party():
    """Imports a module by name, or skips with the reason."""

    def module(name):
        if os.environ.get("THRUSTER_RIG_CI"):
            return importlib.import_module(name)
        return pytest.importorskip(name, reason=f"{name} is not installed (pip install -e .[test])")

    return module
