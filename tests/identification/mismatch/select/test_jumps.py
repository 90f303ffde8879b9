"""Every instant is looked at for a jump of the zero: fast, and as if each step had been whitened and fitted."""

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.locate.residual_structure_test import residual_structure
from identification.mismatch.model.model import Model
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import baseline, start
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.likeliest_trials import TRIED, likeliest_jumps
from tests.identification.diagnosed_runs import run


def wandering(seed):
    """N: a zero that wanders, as a slow noise of 0.2 N."""
    steps = np.random.default_rng(seed).standard_normal(4500)
    return lambda t: 0.2 * np.interp(t, np.arange(4500) / 30, np.convolve(steps, 0.99 ** np.arange(600))[:4500] / 7.1)


@pytest.fixture(scope="module", params=[(37.3, 0.4, "plain"), (101.9, 1.5, "wanders")])
def jumped(request):
    at, size, zero = request.param
    slow = wandering(5) if zero == "wanders" else lambda t: 0.0
    histories = [history_of(run(lambda t, V, F: F + size * (t > at) + slow(t)))]
    data, theta = start(histories)
    state = baseline(data, theta, (), Model())
    return at, data, state, orthogonal_basis(state.fit.jacobian)


def brute(data, state, basis, when):
    (at,) = (h.sampled[r] for h, r in zip(data.histories, data.rows, strict=True))
    columns = state.weights.thrust[0].whiten((at[:, None] >= when).astype(float))
    columns -= basis[: at.size] @ (basis[: at.size].T @ columns)
    return np.abs(columns.T @ state.fit.residual[: at.size]) / np.linalg.norm(columns, axis=0)


def test_the_likeliest_are_those_of_all_steps_one_by_one(jumped):
    truth, data, state, basis = jumped
    found = likeliest_jumps(state.fit, data, state.weights, basis, 3)
    (at,) = (h.sampled[r] for h, r in zip(data.histories, data.rows, strict=True))
    when = np.unique(np.quantile(at, np.linspace(0.01, 0.99, TRIED)))
    score = brute(data, state, basis, when)
    assert found[0] == pytest.approx(when[np.argmax(score)])
    assert found[0] == pytest.approx(truth, abs=0.3)
    far = score[np.abs(when - found[0]) > policy.select.JUMPS_APART * data.scale.duration]
    assert brute(data, state, basis, np.array(found[1:2]))[0] == pytest.approx(far.max(), rel=0.02)
    assert np.min(np.diff(np.sort(found))) > policy.select.JUMPS_APART * data.scale.duration


@pytest.mark.parametrize("jumped", [(101.9, 1.5, "wanders")], indirect=True)
def test_a_jump_that_slow_noise_hides_is_located_in_time(jumped):
    truth, data, state, _ = jumped
    left = residual_structure(state.fit, data, state.weights, np.random.default_rng(0))
    first = left.groups[0]
    assert (first.covariate.quantity, left.p_value < 1e-6) == ("time", True)
    assert float(first.covariate.what.split("jumps at ")[1].split()[0]) == pytest.approx(truth, abs=0.3)
