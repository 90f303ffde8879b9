"""An answer that several files look at, made once."""

from __future__ import annotations

import pytest

from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.answer.answered import BAND, UNEVEN, told
from tests.identification.mismatch.small import known_noise, short


@pytest.fixture(scope="session")
def fitted():
    runs = [short(volts=dead_band(1.2), seed=s, tare=s + 1.0, seconds=60.0) for s in (0, 1)]
    data, estimate = known_noise({BAND: (1.0,), UNEVEN: (1.0,)}, runs)
    return runs, data, estimate


@pytest.fixture(scope="session")
def explained():
    return told(short(volts=dead_band(1.2), seconds=120.0), {BAND: (1.0,)})[0]
