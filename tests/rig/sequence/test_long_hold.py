"""What a hold costs the loop does not grow with its length."""

import numpy as np
import pytest

from identification.steady_state.steady import SteadyMonitor
from rig.sequence.steady import AT_ONCE, Window


class Counting(SteadyMonitor):
    def __init__(self):
        super().__init__()
        self.blocks = []

    def add(self, time, value):
        self.blocks.append(len(time))
        super().add(time, value)


@pytest.mark.parametrize("each", [1, 20, 3000])
def test_samples_are_taken_in_while_it_lasts_and_none_is_lost(each):
    t = np.arange(30_000) * 1e-3
    rows = list(zip(t.tolist(), np.random.default_rng(1).normal(5.0, 1.0, t.size).tolist(), strict=True))
    counting = Counting()
    window = Window(2.0, lambda: counting)
    for begin in range(0, len(rows), each):
        window.add(tuple(rows[begin : begin + each]))
        assert len(window._new) < AT_ONCE
    assert max(counting.blocks) <= AT_ONCE + each
    at_once = SteadyMonitor()
    late = np.array(rows)[2000:]
    at_once.add(late[:, 0], late[:, 1])
    assert window.estimate.mean == at_once.mean
    assert window.estimate.std_error == at_once.std_error
