"""Fonts stay open once matplotlib has found them: they are opened before a test is asked what it left open."""

from __future__ import annotations

import pytest

from tests.rig.report_reading import open_fonts


@pytest.fixture(autouse=True, scope="session")
def fonts():
    open_fonts()
