"""Answers made up or of a small run."""

from __future__ import annotations

import numpy as np

from identification.mismatch.answer import stage
from identification.mismatch.answer.draft import Draft
from identification.mismatch.diagnosis import (
    Finding,
    NextExperiment,
    PlanStep,
    RivalFinding,
)
from identification.mismatch.faults.stage import Sound
from identification.mismatch.locate.stage import run as located_by
from identification.mismatch.name.stage import run as named_by
from identification.mismatch.unexplained import Remainder
from identification.mismatch.unnamed.stage import run as completed_by
from identification.mismatch.validate.stage import run as validated_by
from identification.mismatch.value import Value, Where
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from tests.identification.diagnosed_runs import C
from tests.identification.mismatch.small import rng, selected

BAND, UNEVEN = DeadBand(), Asymmetry()


def finding(effect="dead_band", *losses, statement="Dead band."):
    rivals = tuple(RivalFinding(f"rival{i}", "", {}, loss, "") for i, loss in enumerate(losses))
    return Finding(effect, "", statement, {"w": Value(1.0, 0.1, "V")}, 1e-9, 50.0, 1.0, rivals)


LEFT = Remainder(Where("time", 1.0, 2.0, "s"), 0.5, 1e-9, ((1.5, 0.2, 0.1),), "Something is left.")


SWEEP = NextExperiment("separates a from b", (PlanStep(5.0, 3.0),), 0.9)


def draft(**changes):
    how = {"baseline_model": "C V|V|", "baseline": {"C": Value(C, 0.01, "N/V^2")}, "mismatch": (), "findings": ()}
    return Draft(**{**how, "model_terms": (), "model": {"C": Value(C, 0.01, "N/V^2")}, **changes})


def told(recording, values, terms=()):
    """The stages behind a search whose model is known."""
    chosen = selected(values, [recording], terms)
    located = located_by(chosen, rng(0))
    named = named_by(chosen, located)
    validated = validated_by(located.estimate, named, chosen.data, ())
    completed = completed_by(chosen, located, validated, (), rng(1))
    sound = Sound(chosen.data.histories, (), (), ())
    case = stage.Case((recording,), sound, (), (), None, ("a note",))
    found = stage.run(case, stage.Found(chosen, located, completed, None, {}), rng(2))
    return found, chosen, completed, located


def plain(node):
    """Whether it is all numbers that are numbers, texts and nothing."""
    if isinstance(node, dict):
        return all(isinstance(k, str) and plain(v) for k, v in node.items())
    if isinstance(node, list):
        return all(map(plain, node))
    return node is None or isinstance(node, str | bool | int) or bool(np.isfinite(node))
