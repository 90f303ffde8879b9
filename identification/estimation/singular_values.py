"""The thin singular value decomposition that does not give up."""

from __future__ import annotations

import numpy as np

from identification.recording import Floats


def thin_svd(matrix: Floats) -> tuple[Floats, Floats, Floats]:
    """U (m, k), s (k,), Vt (k, n) with k = min(m, n), as `numpy.linalg.svd(matrix, full_matrices=False)`.

    LAPACK's divide and conquer (gesdd) fails on rare finite matrices with many singular values near zero; those are
    decomposed by QR iteration (gesvd). Raises numpy.linalg.LinAlgError for values that are not finite.

    >>> U, s, Vt = thin_svd(np.array([[3.0, 0.0], [0.0, 0.0], [4.0, 0.0]]))
    >>> s.tolist(), U.shape, Vt.shape
    ([5.0, 0.0], (3, 2), (2, 2))
    """
    try:
        U, s, Vt = np.linalg.svd(matrix, full_matrices=False)
    except np.linalg.LinAlgError:
        if not np.isfinite(matrix).all():
            raise
        from scipy.linalg import svd  # hardly ever needed

        U, s, Vt = svd(matrix, full_matrices=False, lapack_driver="gesvd")
    return U, s, Vt
