"""Noise is what its law says: size, spectrum, tails; and it repeats with its seed."""

import numpy as np
import pytest
from scipy.signal import welch
from scipy.stats import kurtosis

from sim_devices.world.noise_law import NoiseLaw, Peak, Slow, drawn, flicker, scaled, spectrum

RATE = 100.0
N = 200_000
LAWS = {
    "white": NoiseLaw(0.3),
    "correlated": NoiseLaw(0.1, slow=(Slow(0.3, 0.2),)),
    "flicker": NoiseLaw(0.05, slow=flicker(0.3, 50.0, 0.05)),
    "resonant": NoiseLaw(0.1, peak=Peak(0.3, 12.0, 1.0)),
    "heavy_tailed": NoiseLaw(0.3, tails=5.0),
}


def series(law, seed=1, value=0.0):
    return drawn(law, np.full(N, value), RATE, np.random.default_rng(seed))


@pytest.mark.parametrize("name", LAWS)
def test_the_spectrum_is_what_the_law_says(name):
    frequency, density = welch(series(LAWS[name]), RATE, nperseg=4096)
    inner = slice(4, -4)
    ratio = density[inner] / spectrum(LAWS[name], frequency[inner], RATE)
    bands = [float(np.mean(part)) for part in np.array_split(ratio, 12)]
    assert bands == pytest.approx([1.0] * 12, abs=0.12)


@pytest.mark.parametrize("name", ["white", "correlated", "resonant", "heavy_tailed"])
def test_the_size_is_what_the_law_says(name):
    law = LAWS[name]
    size = np.sqrt(law.white**2 + sum(s.std**2 for s in law.slow) + (law.peak.std**2 if law.peak else 0.0))
    assert np.std(series(law)) == pytest.approx(size, rel=0.03)


def test_a_ladder_is_one_over_f():
    frequency = np.geomspace(0.03, 1.0, 40)
    density = spectrum(NoiseLaw(0.0, slow=flicker(1.0, 300.0, 0.01)), frequency, 1e4)
    assert density * frequency == pytest.approx(np.full(40, np.mean(density * frequency)), rel=0.08)


def test_heavy_tails_are_heavy():
    assert kurtosis(series(LAWS["heavy_tailed"])) > 2.0
    assert abs(kurtosis(series(LAWS["white"]))) < 0.1


def test_proportional_noise_follows_the_value():
    law = NoiseLaw(0.3, proportional=0.01)
    assert np.std(series(law, value=40.0)) == pytest.approx(0.5, rel=0.02)
    assert np.std(series(scaled(law, 2.0), value=-40.0)) == pytest.approx(1.0, rel=0.02)


def test_noise_repeats_with_its_seed():
    assert np.array_equal(series(LAWS["flicker"]), series(LAWS["flicker"]))
    assert not np.array_equal(series(LAWS["flicker"]), series(LAWS["flicker"], seed=2))


def test_a_law_that_cannot_be():
    with pytest.raises(ValueError, match="must not be negative"):
        NoiseLaw(-0.1)
    with pytest.raises(ValueError, match="above 2 degrees of freedom"):
        NoiseLaw(0.1, tails=2.0)
