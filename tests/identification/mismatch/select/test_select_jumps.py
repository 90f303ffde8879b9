"""Jumps and ringing: each looked for on a run that has it and on one that has not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import forces
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.whitening import weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.exchange.aliases import within_samples
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.likeliest_trials import jumps, likeliest_jumps, likeliest_rings, sharp_rings
from identification.physics.stand_resonance import StandResonance
from identification.recording import Channel, Recording
from tests.identification.diagnosed_runs import NOISE, C
from tests.identification.mismatch.small import data_of, known_noise, placed, rng, short

RING = StandResonance()


def knocked(size, at=37.3, **how):
    return short(change=lambda t, _V, F: F + size * (t >= at), **how)


def score(data, estimate):
    basis = orthogonal_basis(estimate.fit.jacobian)
    return jumps(estimate.fit.residual, data, estimate.weights, basis), basis


def test_sigmas_of_a_step_are_those_of_a_regression():
    """At every instant: least squares of the step beside C and the tare, with the noise that was put in."""
    data, estimate = known_noise({}, [knocked(0.6)])
    (when, sigmas), _ = score(data, estimate)
    h, r = data.histories[0], data.rows[0]
    w = np.sqrt(h.count[r])
    X = np.column_stack([h.driver[r] * np.abs(h.driver[r]), np.ones(r.size)]) * w[:, None]
    y = h.thrust[r] * w / NOISE
    for at, sigma in zip(when[:15], sigmas[:15], strict=True):
        step = (h.sampled[r] >= at) * w
        rest = step - X @ np.linalg.lstsq(X, step, rcond=None)[0]
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
        assert sigma == pytest.approx(abs(rest @ left) / np.linalg.norm(rest), rel=0.01, abs=0.02)
    assert np.all(np.diff(sigmas) <= 0), "the largest first"


@pytest.mark.parametrize("at", [12.0, 37.3, 70.5])
def test_the_instant_of_a_jump_is_found_also_under_slow_noise(at):
    slow = np.convolve(rng(4).standard_normal(640), np.exp(-np.arange(200) / 40.0))[:640] * 0.05
    data, theta = data_of([short(change=lambda t, _V, F: F + slow + 1.5 * (t >= at))])
    model, begin = placed({}, theta)
    w = weights(data, Noise(NOISE**2, 0.0, (5.0,), (0.1,)), forces(model, begin, data), None, unit=True)
    now = fit(model, begin, data, w)
    first, *others = likeliest_jumps(now, data, w, orthogonal_basis(now.jacobian), 3)
    assert first == pytest.approx(at, abs=0.3)
    assert all(abs(a - b) > 0.1 for a in (first,) for b in others)


def test_a_jump_of_the_gain_is_found_by_what_jumps():
    data, estimate = known_noise({}, [short(change=lambda t, _V, F: F * np.where(t > 50.0, 1.05, 1.0))])
    basis = orthogonal_basis(estimate.fit.jacobian)
    force = forces(estimate.fit.model, estimate.fit.theta, data)
    found = likeliest_jumps(estimate.fit, data, estimate.weights, basis, 1, force)
    assert found[0] == pytest.approx(50.0, abs=2.0)


def test_a_stand_that_rings_is_pointed_to_by_the_ticks():
    """A command in ticks of 0.2 s, sampled at 200 Hz: it rings at 17 Hz after each."""
    start = np.arange(0.0, 20.0, 0.2) + 0.0013
    volts = 6 + 0.3 * rng(1).standard_normal(start.size)
    t = np.arange(0.0, 20.0, 0.005)
    V = volts[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    force, f, z = C * V * np.abs(V), 17.0, 0.05
    w, dt = 2 * np.pi * f, 1e-4
    fine = np.arange(0.0, 20.0, dt)
    pushed = np.interp(fine, t, force)
    x, v = pushed[0], 0.0
    moved = np.empty(fine.size)
    for i, push in enumerate(pushed.tolist()):
        v += dt * (w * w * (push - x) - 2 * z * w * v)
        x += dt * v
        moved[i] = x
    value = np.interp(t, fine, moved) + 0.05 * rng(2).standard_normal(t.size)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, volts),
        Channel("thrust", "cell", "thrust", "N", t, value),
    )
    data, theta = data_of([Recording("ringing", "T1", channels)])
    assert data.ticks, "the ticks have rows of their own"
    model, begin = placed({}, theta)
    w_ = weights(data, Noise(0.05**2, 0.0), forces(model, begin, data), None)
    now = fit(model, begin, data, w_)
    found = likeliest_rings(now, data, RING, 4)
    assert len(found) == 4
    assert min(abs(values[1] - f) for values in found) <= 4.0


@pytest.mark.parametrize("f", [11.0, 31.7, 43.0])
def test_a_stand_that_rings_on_is_pointed_to_by_steps(f):
    """2 % of critical damping after steps of a held command: of the term's own trials, a tenth of the frequency and
    more apart, none saw a ring of 15 sigma."""
    w, z = 2 * np.pi * f, 0.02

    def rings(t, V, F):
        at = np.flatnonzero(np.diff(V) != 0) + 1
        since = t[:, None] - t[at]
        wave = np.exp(-z * w * np.maximum(since, 0.0)) * np.cos(w * since) * (since >= 0)
        return F - wave @ (F[at] - F[at - 1])

    run = short(rings, rate=100.0, seconds=60.0, noise=4.0)
    data, estimate = known_noise({}, [run], 4.0)
    assert not estimate.weights.ticks
    basis = orthogonal_basis(estimate.fit.jacobian)
    found = sharp_rings(estimate.fit, data, estimate.weights, basis, RING, 4)
    assert found[0][1] == pytest.approx(f, rel=0.02)


def test_ringing_beyond_half_the_sampling_rate_gives_way_to_its_alias():
    """8 samples/s: what is said to ring at 5 Hz may as well at 3."""
    data, estimate = known_noise({RING: (0.0, 5.0, 0.1)}, [short()])
    far = replace(estimate.fit, theta=replace(estimate.fit.theta, terms=((0.0, 5.0, 0.1),)))
    found = within_samples(replace(estimate, fit=far), data)
    assert found.fit.values[RING][1] < 4.0
    near = replace(estimate.fit, theta=replace(estimate.fit.theta, terms=((0.0, 2.0, 0.1),)))
    same = replace(estimate, fit=near)
    assert within_samples(same, data) is same
