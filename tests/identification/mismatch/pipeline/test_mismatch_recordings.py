"""Recordings of other kinds: tables, measured rates, channels that lie, lines, and those that are refused."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import Refusal
from identification.recording import Channel, Recording
from sim_devices import concealed
from tests.concealed.recordings import recordings
from tests.identification.diagnosed_runs import NOISE, C, dead_band, levels, run, table
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed, effects, value, within


def test_a_table_of_levels():
    clean = diagnosed(table(lambda v: C * v * np.abs(v)))
    assert clean.verdict == "adequate"
    assert "every fourth of the levels" in clean.heldout.what
    bent = diagnosed(table(lambda v: np.sign(v) * np.abs(v) ** 1.7))
    assert effects(bent) == {"exponent"}
    within(value(bent, "exponent", "exponent"), 1.7)
    assert bent.heldout.after < 0.1 * bent.heldout.before


def turning(volts):
    """V = n/2 + 0.0015 n|n|, in rev/s."""
    n = 2.0 * np.abs(volts)
    for _ in range(60):
        n = 2.0 * (np.abs(volts) - 0.0015 * n**2)
    return np.sign(volts) * n


def test_a_measured_rate_tells_winding_resistance_from_an_exponent():
    """V = n/k + r n|n|: thrust goes with n^2; written in steps of 0.1 N and in the order of its levels."""
    flat = table(lambda v: np.round(0.1 * turning(v) * np.abs(turning(v)), 1), number=161, noise=0.0)
    time, volts = flat.channels[1].time, flat.channels[0].value
    noise = 0.02 * np.random.default_rng(1).standard_normal(volts.size)
    rate = Channel("rate", "tachometer", "rotation_rate", "rev/s", time, turning(volts) + noise)
    found = diagnosed(replace(flat, channels=(*flat.channels, rate)))
    assert "winding_resistance" in found.model_terms
    assert "exponent" not in found.model_terms
    assert found.heldout.after < 0.03  # what rounding leaves


@pytest.mark.parametrize("measured", [True, False])
def test_a_measured_rate_makes_two_static_curves_of_one(measured):
    """Dead band and winding bend V to n, the blade n to thrust: three shapes on the curve of V to thrust are any."""
    flat = table(lambda v: blade(turning(dead_band(1.0)(v))), number=161, noise=0.05)
    time, volts = flat.channels[1].time, flat.channels[0].value
    noise = 0.02 * np.random.default_rng(1).standard_normal(volts.size)
    rate = Channel("rate", "tachometer", "rotation_rate", "rev/s", time, turning(dead_band(1.0)(volts)) + noise)
    found = diagnosed(replace(flat, channels=(*flat.channels, rate)) if measured else flat)
    assert (effects(found) == {"winding_resistance", "dead_band", "exponent"}) == measured
    if measured:
        within(value(found, "dead_band", "half_width"), 1.0)


def blade(n):
    """Reynolds: less than n^2."""
    return 0.2 * n * np.abs(n) ** 0.8


def rotation(seed, seconds, k=2.0, noise=0.01):
    start, level = levels(seed, seconds)
    t = np.arange(0.01, seconds - 0.5, 0.1)
    V = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    n = k * V + noise * np.random.default_rng([seed, 3]).standard_normal(t.size)
    return Channel("rotation_rate", "motor", "rotation_rate", "rev/s", t, n)


def test_thrust_by_the_measured_rate_alone():
    def wave(t):
        return 24 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * t / 20))  # rev/s

    t, s = np.arange(0, 100, 0.1), np.arange(0.005, 99.9, 1 / 30)
    F = 0.125 * wave(s) * np.abs(wave(s)) + 1.0 + NOISE * np.random.default_rng(1).standard_normal(s.size)
    measured = (
        Channel("rotation_rate", "motor", "rotation_rate", "rev/s", t, wave(t)),
        Channel("thrust", "cell", "thrust", "N", s, F),
    )
    found = diagnosed(Recording("waves", "T1", measured))
    assert found.verdict == "adequate"
    assert found.baseline_model == "C n|n|"
    within(found.model["C"], 0.125, rel=1e-3)
    assert found.model["C"].unit == "N s^2/rev^2"


def test_a_rate_beside_the_command_is_a_response_too():
    found = diagnosed(run(seconds=100.0, extra=(rotation(0, 100.0),)))
    assert found.verdict == "adequate"
    assert found.model["C"].value == pytest.approx(C, rel=1e-3)


@pytest.mark.parametrize("lie", ["rescaled", "reversed"])
def test_a_channel_that_lies_is_the_finding_and_its_repair_is_told(lie):
    rng = np.random.default_rng(3)
    case = concealed.case(rng, lie=lie, sampling=30.0, duration=120.0, noise="white", plan="interleaved")
    found = diagnosed(*recordings(case))
    assert [(f.effect, f.form) for f in found.findings] == [("channel_fault", lie)]
    assert found.verdict == "explained"
    assert case.fault["channel"] in found.findings[0].statement
    assert any("put right" in note for note in found.notes)


@pytest.mark.parametrize(
    ("form", "channels"),
    [("frequency", ["rotation_rate"]), ("blades", ["rotation_rate"]), ("blades", [])],
)
def test_a_periodic_disturbance_is_a_finding_with_its_frequency(form, channels):
    rng = np.random.default_rng(3)
    how = {"forms": [form], "channels": channels, "noise": "white", "plan": "interleaved"}
    case = concealed.case(rng, ["periodic_disturbance"], 60.0, sampling=60.0, duration=120.0, **how)
    found = diagnosed(*recordings(case))
    assert effects(found) == {"periodic_disturbance"}
    assert "periodic_disturbance" in found.model_terms
    line, true = found.findings[0].parameters, case.effects[0].parameters
    assert line["amplitude"].value == pytest.approx(true["amplitude"], rel=0.2)
    if form == "blades" and channels:
        assert line["periods_per_turn"].value == pytest.approx(true["blades"], rel=1e-3)
    elif form == "blades":
        turns = true["blades"] * case.scale.rate / case.scale.voltage
        assert line["periods_per_volt_second"].value == pytest.approx(turns, rel=1e-3)
        assert line["periods_per_volt_second"].unit == "1/(V s)"
    else:
        assert line["frequency"].value == pytest.approx(true["frequency"], rel=1e-4)


def refused(*runs, **how):
    found = diagnose(runs, **how)
    assert isinstance(found, Refusal)
    return found.reason


def test_what_cannot_be_diagnosed_together_is_refused():
    a, b = run(seconds=60.0), run(seed=1, seconds=60.0)
    t3 = run(seed=1, seconds=60.0, thruster="T3")
    assert refused() == "no recording was given"
    assert refused(a, t3) == "recordings of several thrusters (T1, T3); diagnose one at a time"
    assert refused(a, b, a) == "the same recording was given twice"
    assert "hold out a recording of T1" in refused(a, holdout=[t3])
    by_rate = replace(run(seed=1, extra=(rotation(1, 100.0),)), recording_id="rate")
    by_rate = replace(by_rate, channels=by_rate.channels[1:])
    assert "driven by different quantities" in refused(a, by_rate)
    silent = replace(b, channels=b.channels[:1])
    assert "run-1.h5 has no thrust channel" in refused(a, silent)
    assert "run-1.h5 has no thrust channel" in refused(a, holdout=[silent])
    short = replace(
        a, channels=(a.channels[0], Channel("thrust", "cell", "thrust", "N", np.arange(8) / 2, np.arange(8.0)))
    )
    assert "8 thrust samples" in refused(short)


def test_what_was_fitted_is_not_held_out():
    a = run(seconds=60.0)
    assert "held out" in refused(a, holdout=[a])
