"""Pulses of the gain that come back: found under slow noise that is as loud, and no false ones."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.locate.pulses import likeliest_pulses
from identification.mismatch.model.model import Model
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import baseline, start
from identification.recording import Channel
from rig.twin.reading import read_twin
from rig.twin.writing import write_twin
from tests.identification.diagnosed_runs import run

PERIOD, LENGTH, SHARE = 21.3, 3.2, 0.012


def losing(t, _V, F):
    return F * np.where(t % PERIOD >= PERIOD - LENGTH, 1 - SHARE, 1.0)


def begun(recording):
    data, theta = start([history_of(recording)])
    return data, baseline(data, theta, (), Model())


@pytest.fixture(scope="module")
def losses():
    return run(losing, seconds=300.0)


def test_period_length_and_share_are_found(losses):
    data, state = begun(losses)
    found = likeliest_pulses(state.fit, data, state.weights)
    assert found.p_value < policy.locate.PLAIN_STRUCTURE_P
    assert found.period == pytest.approx(PERIOD, abs=0.2)
    assert found.length == pytest.approx(LENGTH, abs=0.6)
    assert found.share == pytest.approx(-SHARE, rel=0.25)
    assert found.begin % PERIOD == pytest.approx(PERIOD - LENGTH, abs=1.5)
    assert found.statement.split()[2:5] == [f"{-100 * found.share:.2g}", "%", "less"]


def test_white_residuals_show_none(losses):
    data, state = begun(losses)
    rng = np.random.default_rng(4)
    sigmas = [
        likeliest_pulses(state.fit, data, state.weights, rng.standard_normal(data.size)).sigmas for _ in range(10)
    ]
    assert max(sigmas) < 6.0, "7.3 is what is told"


def test_a_gain_that_is_restless_everywhere_has_none():
    """Turbulence, in proportion to the thrust, of a few seconds."""
    steps = np.random.default_rng(2).standard_normal(400)
    data, state = begun(run(lambda t, _V, F: F * (1 + 0.01 * steps[(t / 1.5).astype(int)]), seconds=300.0))
    assert likeliest_pulses(state.fit, data, state.weights).p_value > policy.locate.PLAIN_STRUCTURE_P


def test_they_are_located_in_time_and_followed_by_a_spline_that_begins_anew(losses, tmp_path):
    found = diagnose([losses])
    assert isinstance(found, Diagnosis)
    assert (found.verdict, found.unexplained.where.quantity) == ("unexplained", "time")
    assert "% less for" in found.unexplained.statement
    assert found.mismatch[0].where.quantity == "time"
    (shape,) = found.unexplained.flexible
    assert shape.period == pytest.approx(PERIOD, abs=0.2)
    assert diagnosis_json(found)["unexplained"]["flexible"]["period"] == shape.period
    (curve,) = shape.splines
    assert np.ptp(curve.value) == pytest.approx(SHARE, rel=0.4)
    assert found.heldout.after < found.unexplained.heldout_without
    path = tmp_path / "T1.twin.json"
    write_twin(found.twin, path)
    assert replace(read_twin(path), origin=found.twin.origin) == found.twin


def test_a_thermometer_that_only_rises_is_time_by_another_name():
    at = np.arange(0.0, 150.0, 1.0)
    warm = Channel("motor_temperature", "winding", "motor_temperature", "degC", at, 18 + 6 * (1 - np.exp(-at / 90)))
    recording = run(lambda t, _V, F: F * (1 - 0.001 * np.clip(t - 60, 0, 30)), rate=20.0, extra=(warm,))
    found = diagnose([recording], without=("heating",))
    left = found.unexplained
    assert (left.where.quantity, left.equals) == ("time", ("motor_temperature",))
    assert "cannot tell them apart" in left.statement
