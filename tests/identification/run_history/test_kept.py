"""What was made is made once; the longest unused is forgotten; the same address is no sameness."""

from __future__ import annotations

from functools import partial

import numpy as np

from identification.recording import Floats
from identification.run_history.least_recently_used import LeastRecentlyUsed


def test_the_longest_unused_is_forgotten() -> None:
    made: list[str] = []

    def make(name: str) -> Floats:
        made.append(name)
        return np.zeros(1)

    kept = LeastRecentlyUsed(most=2)
    for name in ("a", "b", "a", "c", "a", "b"):
        kept(name, partial(make, name))
    assert made == ["a", "b", "c", "b"]


def test_arrays_count_by_identity_even_when_an_address_is_used_again() -> None:
    kept = LeastRecentlyUsed(most=4)
    for i in range(200):
        value = np.full(3, float(i))
        assert kept("twice", partial(np.multiply, 2.0, value), value)[0] == 2 * i
        del value
