"""Chi-square over one value of a fit that no slope tells of, all other values following it to first order."""

from __future__ import annotations

import numpy as np

from identification.mismatch.estimate.fitting import Fit
from identification.recording import Floats


class OthersFollow:
    """Of a fit, while its value at `still`, or nothing of it, is put elsewhere."""

    def __init__(self, found: Fit, still: int = -1) -> None:
        free = np.flatnonzero(found.free)
        others = free != still
        self._which, self._columns = free[others], found.jacobian[:, others]
        self._basis = np.linalg.qr(self._columns)[0]

    def chi2(self, left: Floats) -> float:
        """What stays of `left` (n,), whitened, once the others have followed."""
        along = self._basis.T @ left
        return float(left @ left - along @ along)

    def taken_along(self, vector: Floats, left: Floats) -> Floats:
        """(q,) the whole vector with the others where they leave least of `left`."""
        out = vector.copy()
        out[self._which] += np.linalg.lstsq(self._columns, left, rcond=None)[0]
        return out
