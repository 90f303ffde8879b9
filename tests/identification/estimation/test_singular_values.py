"""The decomposition that LAPACK's faster one gives up on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from identification.estimation.singular_values import thin_svd


def given_up(*_: Any, **__: Any) -> None:
    raise np.linalg.LinAlgError("SVD did not converge")


def test_what_divide_and_conquer_gives_up_on_is_decomposed(monkeypatch: pytest.MonkeyPatch) -> None:
    low_rank = np.random.default_rng(1).standard_normal((40, 3)) @ np.random.default_rng(2).standard_normal((3, 7))
    monkeypatch.setattr(np.linalg, "svd", given_up)
    U, s, Vt = thin_svd(low_rank)
    np.testing.assert_allclose(U * s @ Vt, low_rank, atol=1e-12)
    np.testing.assert_allclose(U.T @ U, np.eye(7), atol=1e-12)
    assert (s > 1e-9).sum() == 3


def test_values_that_are_not_finite_are_no_matter_of_the_method() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        thin_svd(np.array([[1.0, np.nan], [0.0, 1.0]]))
