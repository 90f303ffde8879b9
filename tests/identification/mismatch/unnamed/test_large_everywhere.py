"""What is large everywhere has no place that stands out of draws of itself, and is no noise for that.

A small motor on a bench supply, by the equations of its rotor and winding: nothing of the simulated world. It loses six
tenths of the voltage in its winding, no rate was measured, the zero jumps, and the cell's amplifier filters.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.unnamed.stage import _Without
from identification.recording import Channel, Recording
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed

RESISTANCE, MOTOR_CONSTANT, INERTIA = 0.35, 0.018, 2e-4
DRAG, THRUST = 4.0e-6, 3.2e-4
HOLD, SECONDS, STEP = 3.0, 150.0, 1e-3
JUMP = (85.0, 0.25)


def small_motor(seed=6):
    rng = np.random.default_rng(seed)
    start = HOLD * np.arange(int(SECONDS / HOLD))
    level = np.round(rng.uniform(-16.0, 16.0, start.size), 1)
    level[0] = 0.0
    turning, shown, told = 0.0, 0.0, []
    for volts in np.repeat(level, int(HOLD / STEP)).tolist():
        current = (volts - MOTOR_CONSTANT * turning) / RESISTANCE
        turning += STEP * (MOTOR_CONSTANT * current - DRAG * turning * abs(turning)) / INERTIA
        shown += STEP / 0.01 * (THRUST * turning * abs(turning) - shown)
        told.append(shown)
    time = np.arange(0.0, SECONDS, 0.01)
    thrust = np.array(told)[::10] + 0.3 + JUMP[1] * (time > JUMP[0]) + 0.08 * rng.standard_normal(time.size)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, level),
        Channel("thrust", "cell", "thrust", "N", time, thrust),
    )
    return Recording("small-motor", "T1", channels, source="small-motor.h5")


@pytest.mark.parametrize(("taken", "nothing"), [(0.01, True), (36.0, False)])
def test_terms_that_took_much_did_not_follow_noise(taken, nothing):
    placeless = SimpleNamespace(p_value=2 * policy.locate.RESIDUAL_FALSE_ALARM)
    assert _Without(bare=None, left=placeless, taken=taken).nothing is nothing


def test_a_winding_that_takes_most_of_the_voltage_is_named():
    found = diagnosed(small_motor())
    named = {f.effect: f.parameters for f in found.findings}
    assert {"motor_lag", "winding_resistance", "zero_offset"} <= named.keys()
    assert named["zero_offset"]["at"].value == pytest.approx(JUMP[0], abs=0.2)
    assert found.heldout.after < 0.05 * found.heldout.before
