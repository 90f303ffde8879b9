"""Runs small enough for a test of a second, and models fitted to them as each room meets them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.estimate import Estimate, forces, refresh
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights, weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import start
from identification.mismatch.select.forward_selection import Selected
from identification.physics.term import Term
from identification.recording import Recording
from identification.run_history.history import History
from tests.identification.diagnosed_runs import NOISE, run

Values = Mapping[Term, tuple[float, ...]]


def short(*args, **how) -> Recording:
    """A run of 80 s at 8 samples/s, all levels of both signs in it."""
    return run(*args, **{"seconds": 80.0, "rate": 8.0, **how})


def history(recording: Recording) -> History:
    """Its history; no refusal."""
    found = history_of(recording)
    assert isinstance(found, History), found
    return found


def data_of(recordings: Sequence[Recording], *, clocks: bool = False) -> tuple[Data, Theta]:
    """The runs and where a fit begins; clocks agree unless they are asked to be doubted."""
    data, theta = start([history(each) for each in recordings])
    return (data if clocks else replace(data, most_shift=0.0)), theta


def placed(values: Values, theta: Theta) -> tuple[Model, Theta]:
    """The model of these terms at these values."""
    model = Model()
    for term in values:
        model = model.plus(term)
    return model, replace(theta, terms=tuple(values[term] for term in model.terms))


def white(data: Data, model: Model, theta: Theta, std: float = NOISE) -> Weights:
    """Of white noise."""
    return weights(data, Noise(std**2, 0.0), forces(model, theta, data), None, unit=True)


def estimated(values: Values, recordings: Sequence[Recording], *, clocks: bool = False) -> tuple[Data, Estimate]:
    """The model of these terms fitted, its noise estimated with it."""
    data, theta = data_of(recordings, clocks=clocks)
    return data, refresh(*placed(values, theta), data, None, None)


def known_noise(values: Values, recordings: Sequence[Recording], std: float = NOISE) -> tuple[Data, Estimate]:
    """The model of these terms fitted beside the white noise that was put in."""
    data, theta = data_of(recordings)
    model, begin = placed(values, theta)
    w = white(data, model, begin, std)
    return data, Estimate(fit(model, begin, data, w), Noise(std**2, 0.0), None, w, data.thrust_rows)


def selected(values: Values, recordings: Sequence[Recording], terms: Sequence[Term] = ()) -> Selected:
    """As a search ends, beside the white noise that was put in."""
    data, before = known_noise({}, recordings)
    bigger, theta = placed(values, before.fit.theta)
    after = replace(before, fit=fit(bigger, theta, data, before.weights)) if values else before
    return Selected(data, tuple(terms), before, after, (), None)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)
