"""Noise is what its law says: size, spectrum, tails; and it repeats with its seed."""

import numpy as np
import pytest
from scipy.signal import welch
from scipy.stats import kurtosis

from sim_devices.world.noise_law import (
    NoiseLaw,
    Peak,
    Slow,
    Unrest,
    drawn,
    flicker,
    rounded,
    scaled,
    spectrum,
    stationary,
)

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


def test_unrest_is_a_share_of_the_step_and_dies_with_its_decay():
    """Std over many draws at each time after a step of 40; before it there is none."""
    law, step = NoiseLaw(0.0, unrest=Unrest(0.05, 0.5, 0.1)), np.repeat([-10.0, 30.0], 100)
    runs = np.array([drawn(law, step, RATE, np.random.default_rng(s)) for s in range(4000)])
    after = np.arange(100) / RATE
    assert np.all(runs[:, :100] == 0.0)
    assert np.std(runs[:, 100:], axis=0) == pytest.approx(0.05 * 40.0 * np.exp(-after / 0.5), rel=0.06)
    one, other = runs[:, 105], runs[:, 115]
    assert np.corrcoef(one, other)[0, 1] == pytest.approx(np.exp(-0.1 / 0.1), abs=0.05)


def test_a_quantum_adds_a_twelfth_of_its_square_where_noise_is_larger_and_silence_where_it_is_smaller():
    value = np.full(N, 0.2)
    for quantum, noisy in ((0.5, True), (10.0, False)):
        law = NoiseLaw(0.5 if noisy else 0.05, quantum=quantum)
        read = rounded(law, value + drawn(law, value, RATE, np.random.default_rng(1)))
        assert np.all(np.abs(read / quantum - np.round(read / quantum)) < 1e-9)
        told = law.white_std(value)[0]
        assert (np.std(read) == pytest.approx(told, rel=0.01)) if noisy else (np.ptp(read) == 0.0)
    assert np.array_equal(rounded(NoiseLaw(0.3), value), value)


def test_a_stationary_law_has_the_power_of_the_law_itself():
    value = np.tile(np.repeat([0.0, 40.0], 2000), N // 4000)
    law = NoiseLaw(0.1, proportional=0.01, unrest=Unrest(0.05, 1.0, 0.2), slow=(Slow(0.1, 0.3),))
    level = stationary(law, value, RATE)
    frequency = np.linspace(0.0, RATE / 2.0, 20001)
    whole = np.trapezoid(spectrum(level, frequency, RATE), frequency)
    assert whole == pytest.approx(np.var(drawn(law, value, RATE, np.random.default_rng(1))), rel=0.05)
    assert (level.unrest, level.proportional) == (None, 0.0)


def test_noise_repeats_with_its_seed():
    assert np.array_equal(series(LAWS["flicker"]), series(LAWS["flicker"]))
    assert not np.array_equal(series(LAWS["flicker"]), series(LAWS["flicker"], seed=2))


def test_a_law_that_cannot_be():
    with pytest.raises(ValueError, match="must not be negative"):
        NoiseLaw(-0.1)
    with pytest.raises(ValueError, match="quantum must not be negative"):
        NoiseLaw(0.1, quantum=-1.0)
    with pytest.raises(ValueError, match="a share and a decay above zero"):
        NoiseLaw(0.1, unrest=Unrest(0.1, 0.0, 1.0))
    with pytest.raises(ValueError, match="above 2 degrees of freedom"):
        NoiseLaw(0.1, tails=2.0)
