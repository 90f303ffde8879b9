"""Lines of the rotor: as n^2, times what scipy says that a mass on a spring makes of them."""

import numpy as np
import pytest
from scipy.signal import TransferFunction, freqresp

from sim_devices.world import World, read_world
from sim_devices.world.history import clock
from sim_devices.world.sweep import sweep

DT = 1e-3
T = clock(6000, DT)
K = 1.5
LINE = {"amplitude": 0.5, "blades": 3, "reference_voltage": 20.0, "phase": 0.7}


def wave(volts, line, **more):
    """Settled line of a hold at `volts`: its complex amplitude at 3 n against sin(2 pi 3 n t)."""
    thruster = {"C": 0.4, "rotor": "instant", "rate_per_volt": K}
    settings = read_world({"thrusters": {"T": thruster}, "effects": {"periodic_disturbance": line, **more}})
    h = sweep(settings, DT, np.full(T.size, volts), np.zeros(T.size), np.full(T.size, 18.0))
    late = slice(2000, None)
    turn = np.exp(-2j * np.pi * 3.0 * K * volts * (T + DT))[late]  # the first point is a step after rest
    return 2j * np.mean((h.reading - 0.4 * volts**2)[late] * turn)


@pytest.mark.parametrize("volts", [4.0, 10.0, 20.0])
def test_imbalance_and_blade_pass_grow_as_the_rate_squared(volts):
    assert wave(volts, LINE) == pytest.approx(0.5 * (volts / 20.0) ** 2 * np.exp(0.7j), rel=1e-6)


@pytest.mark.parametrize("volts", [4.0, 10.0, 20.0])
def test_the_stand_answers_the_line_as_a_mass_on_a_spring(volts):
    w = 2.0 * np.pi * 45.0
    stand = TransferFunction([w * w], [1.0, 2.0 * 0.04 * w, w * w])
    _, (answer,) = freqresp(stand, [2.0 * np.pi * 3.0 * K * volts])
    told = wave(volts, {**LINE, "resonance": 45.0, "damping": 0.04})
    assert told == pytest.approx(wave(volts, LINE) * answer, rel=1e-6)


def test_a_line_is_largest_where_the_blades_meet_the_stand():
    """n^2 |H| has its peak a little above f_n / blades: at ratio 1 / sqrt(1 - 2 zeta^2)."""
    levels = np.linspace(4.0, 20.0, 81)
    sizes = [abs(wave(v, {**LINE, "resonance": 45.0, "damping": 0.1})) for v in levels.tolist()]
    peak = 45.0 / (3.0 * K) / np.sqrt(1.0 - 2.0 * 0.1**2)
    assert levels[int(np.argmax(sizes))] == pytest.approx(peak, abs=0.2)


def test_the_stand_that_is_concealed_is_the_one_that_answers():
    own = wave(12.0, {**LINE, "resonance": 60.0, "damping": 0.1})
    assert wave(12.0, LINE, stand_resonance={"frequency": 60.0, "damping": 0.1}) == pytest.approx(own, rel=1e-4)
    thruster = {"C": 0.4, "rotor": "instant"}
    settings = read_world(
        {"thrusters": {"T": thruster}, "effects": {"stand_resonance": {"frequency": 9.0, "damping": 0.1}}}
    )
    state = World(settings, np.random.default_rng(1)).state
    assert (state.stand_frequency, state.stand_damping) == (9.0, 0.1)


def test_pick_up_keeps_its_size_at_every_rate():
    line = {"amplitude": 0.5, "frequency": 13.5, "phase": 0.7}  # 3 K 3: the line that is measured at 3 V
    assert abs(wave(3.0, line)) == pytest.approx(0.5, rel=1e-6)
    still = wave(3.0, line, stand_resonance={"frequency": 13.5, "damping": 0.2})
    assert abs(still) == pytest.approx(0.5, rel=1e-4)
