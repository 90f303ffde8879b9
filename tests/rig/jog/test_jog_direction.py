"""Which way it pushes: sentences from constructed runs, for each way that wires, cell and sensor can be reversed."""

from __future__ import annotations

import numpy as np
import pytest

from identification.recording import Channel, Recording, Step
from rig.jog.direction import SETTLE, direction_of, sentences


def run(thrust: float, rotation: float | None, volts: float = 3.0, held: float = 3.0, cut: bool = False) -> Recording:
    """2 s of tare at 0.75 N, a second of ramp, then the hold: means as given, noise 0.05 N and 0.01 rev/s."""
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 3.0 + held, 0.02)
    on = time >= 3.0
    force = Channel("thrust", "cell", "thrust", "N", time, 0.75 + thrust * on + 0.05 * rng.standard_normal(time.size))
    channels = [force]
    if rotation is not None:
        rate = rotation * on + 0.01 * rng.standard_normal(time.size)
        channels.append(Channel("rotation_rate", "motor", "rotation_rate", "rev/s", time, rate))
    steps = (Step(0, "tare", 0.0, 0.0, 2.0), Step(1, "ramp", volts, 2.0, 3.0))
    steps += (Step(2, "free" if cut else "hold", volts, 3.0, 3.0 + held),)
    return Recording("id", "jog", tuple(channels), steps)


@pytest.mark.parametrize(
    ("thrust", "rotation", "said"),
    [
        (3.5, 3.0, "as it should be: a positive command gives positive thrust and positive rotation"),
        (-3.5, -3.0, "both are reversed: swap two motor wires"),
        (-3.5, 3.0, "Forward: set sign = -1 in [devices.cell]. Backward: swap two motor wires"),
        (3.5, -3.0, "the rotation is counted backwards"),
        (-3.5, None, "swap two motor wires or set sign = -1 in [devices.cell]"),
        (3.5, None, "the force is right"),
        (0.0, 3.0, "the propeller turns and no force is seen"),
        (0.0, 0.0, "nothing moved that is measured"),
    ],
)
@pytest.mark.parametrize("cut", [False, True], ids=["whole", "let go"])
def test_each_way_of_being_wired(thrust, rotation, said, cut):
    assert said in sentences(direction_of(run(thrust, rotation, cut=cut), 3.0), "cell")[-1]


def test_what_a_coarse_motor_controller_made_of_the_voltage_is_that_voltage():
    found = direction_of(run(3.5, 3.0, volts=2.976), 3.0)
    assert found.held == pytest.approx(3.0 - SETTLE)
    assert sentences(found, "cell")[-1].startswith("as it should be")


def test_a_negative_command_is_judged_by_its_own_sign():
    lines = sentences(direction_of(run(-3.5, -3.0, volts=-3.0), -3.0), "cell")
    assert lines[0].startswith("thrust is negative (-3.5")
    assert "for a negative command of -3 V" in lines[0]
    assert lines[-1] == "as it should be: a negative command gives negative thrust and negative rotation"
    lines = sentences(direction_of(run(3.5, 3.0, volts=-3.0), -3.0), "cell")
    assert lines[-1] == "both are reversed: swap two motor wires"


def test_too_short_a_hold_says_nothing_of_the_direction():
    (line,) = sentences(direction_of(run(-3.5, -3.0, held=1.0), 3.0), "cell")
    assert "nothing can be said of the direction" in line
    assert "held for 0.3 s beyond" in line


def test_noise_is_no_direction():
    wrong = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        time = np.arange(0.0, 6.0, 0.02)
        slow = np.repeat(rng.standard_normal(int(6.0 / 0.25)), 13)[: time.size]  # correlated over a quarter of a second
        force = Channel("thrust", "cell", "thrust", "N", time, 0.05 * slow)
        steps = (Step(0, "tare", 0.0, 0.0, 2.0), Step(1, "hold", 3.0, 2.0, 6.0))
        found = direction_of(Recording("id", "jog", (force,), steps), 3.0)
        wrong += found.thrust is not None and found.thrust.sign != 0
    assert wrong <= 4
