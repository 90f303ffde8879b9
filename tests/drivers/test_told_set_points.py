"""What a motor controller of coarse set-points is told: its driver says so, on the steps of the device."""

from pathlib import Path

import numpy as np
import pytest

from drivers.protocols import Coarse
from rig.campaign.bench import build
from rig.campaign.loading import load_bench

BENCHES = Path(__file__).parents[2] / "benches"
STEPS = {
    "roboteq": 48.0 / 1000,
    "smc_g2": 48.0 / 3200,
    "dronecan": 48.0 / 8191,
    "cia402": 1.0 / 60.0,
    "cia401": 1.0 / 3276.7,
    "maestro": 48.0 / (4 * (1900.0 - 1500.0 - 25.0)),
    "scpi_supply": 0.001,
}
"""V between two set-points, by the numbers of the bench file and the device's own."""


@pytest.mark.parametrize("name", STEPS)
def test_what_is_told_is_the_nearest_step(name):
    motor = build(load_bench(BENCHES / name / "bench.toml")).motor
    assert isinstance(motor, Coarse)
    assert motor.told(0.0) == 0.0
    asked = np.random.default_rng(7).uniform(0.1, 9.9, 200)
    told = np.array([motor.told(float(volts)) for volts in asked])
    assert np.abs(told - asked).max() <= STEPS[name] / 2 + 1e-9
    assert np.abs(told / STEPS[name] - np.round(told / STEPS[name])).max() < 1e-5
    assert [motor.told(float(volts)) for volts in told] == pytest.approx(told, abs=1e-12)
    if name != "scpi_supply":
        assert [motor.told(float(-volts)) for volts in asked] == pytest.approx(-told, abs=1e-12)


@pytest.mark.parametrize("name", ["simulated", "vesc_uart", "odrive"])
def test_a_controller_of_fine_steps_is_told_what_is_asked(name):
    bench = build(load_bench(BENCHES / name / "bench.toml"))
    assert bench.told(5.0012345) == 5.0012345
