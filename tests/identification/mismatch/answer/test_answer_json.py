"""Every answer as JSON, whatever its numbers."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.diagnosis import (
    Adequate,
    Ambiguous,
    Diagnosis,
    Explained,
    Mismatch,
    Unexplained,
)
from identification.mismatch.value import Value, Where
from tests.identification.mismatch.answer.answered import LEFT, SWEEP, finding, plain, told
from tests.identification.mismatch.small import short


@pytest.mark.parametrize(("x", "y"), product([np.nan, np.inf, -np.inf, 0.5], repeat=2))
def test_whatever_the_numbers_the_json_is_one(explained, x, y):
    """Not finite becomes null, everywhere."""
    spoiled = replace(
        explained,
        baseline={"C": Value(x, y, "N/V^2")},
        mismatch=(Mismatch("thrust", Where("time", x, y, "s"), x, y, "there"),),
        answer=Unexplained(
            (replace(finding(), p_value=x, bic_gain=abs(y) or 1.0),),
            replace(LEFT, share=x, p_value=y, shape=((x, y, x),)),
            SWEEP,
        ),
        whiteness_p=x,
        chi2_per_dof=y,
    )
    found = diagnosis_json(spoiled)
    assert plain(found)
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    "answer",
    [Adequate(), Explained((finding(),)), Ambiguous((finding("a", 0.5),), SWEEP), Unexplained((), LEFT, None)],
    ids=lambda a: a.name,
)
def test_every_verdict_has_its_keys(explained, answer):
    found = diagnosis_json(replace(explained, answer=answer))
    assert (found["verdict"], found["format"], found["version"]) == (answer.name, "thruster-rig-diagnosis", 1)
    assert (found["unexplained"] is None) == (answer.name != "unexplained")
    assert (found["next_experiment"] is None) == (answer.name != "ambiguous")
    assert isinstance(found["statement"], str)
    assert [f["effect"] for f in found["findings"]] == [f.effect for f in replace(explained, answer=answer).findings]
    if answer.name == "ambiguous":
        assert found["next_experiment"] == {
            "why": SWEEP.why,
            "steps": [{"command_voltage": 5.0, "duration": 3.0, "flow_speed": 0.0}],
            "expected_power": 0.9,
        }
        assert found["findings"][0]["rival_details"][0]["bic_loss"] == 0.5
    if answer.name == "unexplained":
        assert found["unexplained"]["where"] == {"quantity": "time", "from": 1.0, "to": 2.0, "unit": "s"}
        assert found["unexplained"]["shape"] == [{"at": 1.5, "residual": 0.2, "std": 0.1, "determined": True}]
        assert found["unexplained"]["flexible"] is None


def test_intervals_of_values_are_told_as_they_are():
    lopsided = Value(1.0, 0.2, "V", (0.7, 1.9))
    assert isinstance(lopsided, Value)
    data = replace(told(short(), {})[0], baseline={"C": lopsided, "D": Value(1.0, 0.5, "N")})
    assert isinstance(data, Diagnosis)
    found = diagnosis_json(data)["baseline"]["parameters"]
    assert (found["C"]["low"], found["C"]["high"]) == (0.7, 1.9)
    assert found["C"]["determined"] is True
    assert (found["D"]["low"], found["D"]["high"]) == pytest.approx((1.0 - 0.98, 1.98), abs=1e-3)


def test_what_is_not_determined_keeps_its_numbers_and_says_so():
    lost = Value(24.0, 5844288569.0, "s", limits=(1.0, 400.0))
    data = replace(told(short(), {})[0], baseline={"time_constant": lost})
    assert diagnosis_json(data)["baseline"]["parameters"]["time_constant"] == {
        "value": 24.0,
        "std": 5844288569.0,
        "low": 1.0,
        "high": 400.0,
        "unit": "s",
        "determined": False,
    }
    left = replace(LEFT, shape=((1.0, 2.0, 0.1), (2.0, -44.7, 55.0)))
    rows = diagnosis_json(replace(data, answer=Unexplained((), left, None)))["unexplained"]["shape"]
    assert [row["determined"] for row in rows] == [True, False]
