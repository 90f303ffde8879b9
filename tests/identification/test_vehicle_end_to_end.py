"""A simulated vehicle identified from its recordings alone: drag and efficiency first, then inertia."""

import numpy as np
from scipy.stats import chi2
from vehicle_world import distance, drawn, identify, truth_of

AXES = ("surge", "heave")


def test_blind_vehicle_is_found_within_its_stated_covariance():
    rng = np.random.default_rng([41, 1])
    hull, vehicle = drawn(rng, 1)
    found = identify(hull, vehicle, rng, axes=AXES)
    for axis in AXES:
        estimate = found.drag[axis].estimate.determined()
        d2 = distance(estimate, truth_of(hull, axis, estimate.names))
        assert d2 < chi2.ppf(0.9999, len(estimate.names)), axis
        inertia = found.inertia[axis].estimate
        m = inertia.names.index("m")
        z = (inertia.mean[m] - hull.axes[axis].inertia) / np.sqrt(inertia.cov[m, m])
        assert abs(z) < 4.0, axis
