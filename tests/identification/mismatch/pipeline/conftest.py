"""Diagnoses that several files look at, made once."""

import numpy as np
import pytest

from tests.identification.diagnosed_runs import dead_band, run
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed


@pytest.fixture(scope="session")
def dead():
    return diagnosed(run(volts=dead_band(1.5)))


@pytest.fixture(scope="session")
def uneven():
    return diagnosed(run(lambda _t, V, F: np.where(V < 0, 0.93, 1.0) * F))


@pytest.fixture(scope="session")
def bump():
    """15 % less at +8 V only: no term of the catalogue."""
    return diagnosed(run(lambda _t, V, F: F * (1 - 0.15 * ((V > 7) & (V < 9))), rate=10.0, noise=0.2))
