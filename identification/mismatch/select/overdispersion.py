"""How much noisier a residual is in some directions than its noise model has it: what that model cannot describe (noise
after every step, in bursts) makes any likelihood ratio larger there, and raises the bar by as much.
"""

from __future__ import annotations

import numpy as np

from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.select.family_wise import beside, block_edges, orthogonal_basis
from identification.physics.term import Term
from identification.recording import Floats


def dispersion(span: Floats, residual: Floats) -> float:
    """How much noisier a residual (n,) is in an orthonormal span (n, q) than white noise of unit variance; at least 1.

    The mean square of its scores over all signs of blocks. A likelihood ratio grows by as much where the noise is of a
    kind that its model does not know (McCullagh and Nelder, Generalized Linear Models, 1989, section 4.5).
    """
    if not span.shape[1]:
        return 1.0
    clean = residual - span @ (span.T @ residual)
    parts = np.add.reduceat(span * clean[:, None], block_edges(residual.size), axis=0)
    mean = float(np.sum(parts**2)) / int(span.shape[1])
    return max(1.0, mean)


def dispersion_of(term: Term, fitted: Fit, size: int) -> float:
    """The same where the parameters of a term move the thrust (the first `size` rows), beside all others."""
    own = np.zeros(fitted.free.size, dtype=bool)
    own[fitted.layout.of(term)] = True
    columns, mine = fitted.jacobian[:size], own[fitted.free]
    span = beside(columns[:, mine], orthogonal_basis(columns[:, ~mine]))
    return dispersion(orthogonal_basis(span), fitted.residual[:size])
