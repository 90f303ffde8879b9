"""What to do next is known for every quantity over which something can be left."""

from identification.mismatch.answer.advice import ADVICE, what_to_do
from identification.mismatch.select.covariates import covariates
from tests.identification.mismatch.small import known_noise, short


def test_each_covariate_of_a_run_has_its_advice():
    data, estimate = known_noise({}, [short()])
    there = {c.quantity for c in covariates(estimate.fit, data)}
    assert {"command_voltage", "time", "time_since_step", "direction"} <= there
    assert there <= ADVICE.keys()
    assert all(what_to_do(q).startswith("Next: ") and what_to_do(q).endswith(".") for q in there)


def test_of_an_unknown_quantity_nothing_is_said():
    assert what_to_do("frequency") == ""
