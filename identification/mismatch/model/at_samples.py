"""What a model says of the thrust at the samples: of an instant, or what the converter makes of it."""

from __future__ import annotations

from identification.mismatch.model.converted import beside_means
from identification.mismatch.model.model import Model
from identification.mismatch.model.on_its_way import on_its_way
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.sub_interval import ahead, shown
from identification.physics.term import Scale
from identification.recording import Floats
from identification.run_history.filters import reconstructed
from identification.run_history.remembered import RememberedRun


def at_samples(
    model: Model, theta: Theta, run: RememberedRun, scale: Scale, tare: float, late: float
) -> tuple[Floats, Floats]:
    """(thrust without tare, rate in units of the driver), (M,) each: thrust at the mean time of the samples of each
    interval, the rate its mean. `late`: s by which the force comes after the driver."""
    history = run.history
    F, x = predict(model, theta, run, scale, tare)
    part = shown(model, theta, history, F, x, tare)
    share = theta.C * part
    F = F + part * on_its_way(model, theta, run, x, scale, tare)
    if not history.converter.instant and history.ticks is None:
        F = F + share * history.excess
    if theta.shift:
        F = run.delayed(F, theta.shift)
    if not history.converter.instant:
        more = share * beside_means(model, theta, run, x, scale, late, tare) if history.ticks is not None else 0.0
        return run.converted(F) + more, x
    more = share * ahead(model, theta, run, x, scale, late, tare)
    return reconstructed(F, history.middle, history.sampled) + more, x
