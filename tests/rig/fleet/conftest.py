"""Fonts are opened once, before a test looks at what it left open."""

from __future__ import annotations

import pytest

from tests.rig.report_reading import open_fonts


@pytest.fixture(autouse=True, scope="session")
def fonts():
    open_fonts()
