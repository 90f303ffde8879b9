"""A sentence of a finding never says less than that there is one."""

import pytest

from identification.physics.asymmetry import Asymmetry
from identification.physics.digits import beside, percent
from identification.physics.exponent import Exponent
from identification.physics.inflow_dynamics import FORMS as INFLOW
from identification.physics.term import Scale

SCALE = Scale(10.0, "V", 40.0, 60.0, 0.1)


@pytest.mark.parametrize(
    ("value", "neutral", "least", "told"),
    [
        (0.93, 1.0, 0, "0.930"),
        (0.99874, 1.0, 2, "0.9987"),
        (1.0, 1.0, 2, "1.00"),
        (1.9962, 2.0, 2, "1.9962"),
        (0.526, 1.0, 2, "0.53"),
        (float("nan"), 1.0, 2, "nan"),
    ],
)
def test_two_digits_of_the_difference(value, neutral, least, told):
    assert beside(value, neutral, least) == told


@pytest.mark.parametrize(("share", "told"), [(0.234, "23"), (0.0412, "4.1"), (0.0004, "0.040"), (1.5, "150")])
def test_per_cent(share, told):
    assert percent(share) == told


def test_a_small_effect_is_told_with_its_size():
    assert "gives 0.9989 of its forward thrust" in Asymmetry().statement((0.99891,), SCALE)
    assert "|V|^1.9962, not as V^2" in Exponent().statement((1.9962,), SCALE)
    assert "overshoots by 0.31 %" in INFLOW[0].statement((0.0031, 0.4), SCALE)
