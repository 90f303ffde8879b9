"""Every threshold of the diagnosis stands once, is read when it decides, and adds up to what the pages say."""

from __future__ import annotations

import ast
import copy
import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.policy.record.page import page, percent
from identification.mismatch.select.stepwise import accept_threshold

ROOT = Path(__file__).parents[4]
ENGINE = ROOT / "identification" / "mismatch"
SOURCES = [path for path in ENGINE.rglob("*.py") if path.parent.name not in ("policy", "record")]
EVERY = dict(policy.thresholds())
DIAGNOSE = (ROOT / "docs" / "howto" / "diagnose.md").read_text(encoding="utf-8")


def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def read_by(node: ast.AST) -> list[str]:
    """Thresholds that are read in this part of the code, as room.NAME."""
    found = (ast.unparse(each) for each in ast.walk(node) if isinstance(each, ast.Attribute))
    return [text.removeprefix("policy.") for text in found if re.fullmatch(r"policy\.\w+\.[A-Z]\w*", text)]


def test_each_says_what_it_is():
    names = [name.partition(".")[2] for name in EVERY]
    assert len(set(names)) == len(names), "a name stands for one decision"
    for name, value in EVERY.items():
        assert value.unit, name
        assert value.reason.endswith("."), name
        assert not value.evidence or value.evidence.endswith("."), name


def test_each_is_read_and_none_is_read_that_is_not_there():
    read = {name for path in SOURCES for name in read_by(tree(path))}
    budget = read_by(tree(ENGINE / "policy" / "record" / "budget.py"))
    assert read | {name for name in EVERY if name in budget} == set(EVERY)


def test_none_is_read_before_it_decides():
    """At the top of a module, in a default or in a class it would be the number of the import, whatever is asked."""
    for path in SOURCES:
        body = tree(path).body
        early = [each for each in body if not isinstance(each, ast.FunctionDef | ast.ClassDef)]
        early += [
            each for b in body if isinstance(b, ast.ClassDef) for each in b.body if isinstance(each, ast.AnnAssign)
        ]
        early += [each.args for b in body for each in ast.walk(b) if isinstance(each, ast.FunctionDef)]
        assert not [name for each in early for name in read_by(each)], path


def test_numbers_that_stay_say_why():
    lacking = []
    for path in SOURCES:
        body = tree(path).body
        for each, after in zip(body, [*body[1:], None], strict=True):
            if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]).strip("()").replace(", ", "").isupper():
                number = any(
                    isinstance(n, ast.Constant) and type(n.value) in (int, float) for n in ast.walk(each.value)
                )
                told = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
                if number and not told:
                    lacking.append(f"{path.relative_to(ENGINE)}: {ast.unparse(each)}")
    assert not lacking


def test_a_threshold_is_a_number():
    level, count = EVERY["select.SCREENING_FALSE_ALARM"], EVERY["select.MODEL_TERMS"]
    assert type(2 * level) is float
    assert type(count + 1) is int
    assert np.asarray(level).dtype == np.float64
    assert json.dumps([level, count]) == "[0.01, 6]"
    assert f"{level} {count:d}" == "0.01 6"
    for value in (level, count):
        for other in (copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert (other, other.unit, other.reason) == (value, value.unit, value.reason)
        with pytest.raises(AttributeError, match="written down once"):
            value.unit = "other"


def test_overridden_until_the_block_ends():
    usual = accept_threshold(1)
    with policy.overridden({"select.KEPT_TERM_FALSE_ALARM": 1e-6}):
        assert accept_threshold(1) > usual
        assert policy.select.KEPT_TERM_FALSE_ALARM.reason
    assert accept_threshold(1) == usual
    assert policy.select.KEPT_TERM_FALSE_ALARM is EVERY["select.KEPT_TERM_FALSE_ALARM"]
    with policy.overridden({"locate.PULSES": 0.2, "select.MODEL_TERMS": 2.6}):
        assert (policy.locate.PULSES, policy.select.MODEL_TERMS) == (1, 3)
    with pytest.raises(KeyError), policy.overridden({"select.MODEL_TERMS": 1, "select.NONE": 1.0}):
        pytest.fail("nothing is moved where one is not known")
    assert policy.select.MODEL_TERMS == 6


def test_page_is_up_to_date():
    assert (ROOT / "docs" / "method-thresholds.md").read_text(encoding="utf-8") == page()


def test_false_alarms_add_up_to_what_is_told():
    for alarm in policy.false_alarms():
        if alarm.counted:
            assert f"| {alarm.name} | {percent(alarm.rate)} |" in DIAGNOSE
    assert f"| sum | {percent(policy.nominal())} |" in DIAGNOSE
    proof = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8")
    (measured,) = re.findall(r"\| false alarms, clean recordings \| (.*?) \|", proof)
    assert measured in DIAGNOSE
