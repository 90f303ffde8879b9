"""What a model says of every sample of the force, where an interval of the history holds several."""

from __future__ import annotations

from identification.mismatch.model.converted import converted_samples
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.sub_interval import sample_lead
from identification.physics.term import Scale
from identification.recording import Floats
from identification.run_history.filters import delayed, within_intervals
from identification.run_history.remembered import RememberedRun


def foretold(model: Model, theta: Theta, run: RememberedRun, scale: Scale, tare: float) -> Floats:
    """(N,) N, without the tare: the force at each sample, or as the converter shows it."""
    h = run.history
    F, x = predict(model, theta, run, scale, tare)
    if theta.shift:
        F = delayed(F, h.edges, theta.shift)
    if not h.converter.instant:
        return converted_samples(model, theta, run, F, scale.driver)
    at = within_intervals(F, h.edges, h.sample_time)
    at += theta.C * sample_lead(model, theta, run, within_intervals(x, h.edges, h.sample_time), scale.driver)
    return at
