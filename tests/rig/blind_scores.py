"""Made-up truths, answers and scores for the tests of the blind proof."""

import numpy as np

from rig.blind.design import Kinds, Order, design
from rig.blind.scoring.score import HeldOut, Interval, Near, Score

WORLD = Kinds(
    effects=("dead_band", "heating", "asymmetry", "exponent", "time_skew", "gain_step", "fouling"),
    forms={"dead_band": ("shrink", "jump"), "heating": ("winding", "magnet")},
    variants={"dead_band": ("smooth",)},
    lies=("swapped", "frozen"),
    noise=("white", "flicker", "heavy_tailed"),
)
CATALOGUE = frozenset({"dead_band", "heating", "asymmetry", "exponent", "time_skew"})


def truth(*effects, fault=None, twins=None, **parameters):
    return {
        "effects": [{"effect": e, "parameters": parameters, "d_prime": 40.0} for e in effects],
        "fault": fault,
        "noise_kind": "white",
        "scale": {"rate": 20.0, "voltage": 10.0, "current": 5.0, "thrust": 80.0, "duration": 400.0},
        "rate": 25.0,
        "plan": ["ramp"],
        "channels": ["current"],
        "twins": twins,
        "error": None,
    }


def finding(effect, rivals=(), form="", **parameters):
    return {
        "effect": effect,
        "form": form,
        "rivals": list(rivals),
        "parameters": {
            name: {"value": v, "std": s, "low": v - 1.96 * s, "high": v + 1.96 * s, "unit": ""}
            for name, (v, s) in parameters.items()
        },
    }


def answer(verdict, *findings, place=None):
    unexplained = None if place is None else {"where": {"quantity": place}, "resembles": ["heating: not constant"]}
    told = {"verdict": verdict, "findings": list(findings), "unexplained": unexplained, "statement": f"{verdict}."}
    return {"seconds": 2.0, "error": None, "code": "abc", "diagnosis": told}


def whole_proof(seeds=4, skill=0.9):
    """Scores of every order of a small world, right with probability `skill`."""
    rng = np.random.default_rng(5)
    return [_one(job, order, rng, skill) for job in design(WORLD, CATALOGUE, seeds) for order in job.orders]


def _one(job, order, rng, skill):
    truth = tuple(job.spec.get("effects", ())) or (("channel_fault",) if "lie" in job.spec else ())
    good, held = rng.random() < skill, HeldOut(1.0 + 0.02 * rng.random(), 1.1 + rng.random(), 0.1)
    if order.cell in ("outside", "removed"):
        near = Near("exponent", float(rng.choice([3.0, 20.0])))
        said = ("unexplained", (), "time") if good else ("explained", ("exponent",), "")
        return Score(order, truth, said[0], said[1], place=said[2], near=near, seconds=3.0, case="white noise")
    if not truth:
        named = () if good else ("motor_lag",)
        return Score(order, (), "explained" if named else "adequate", named, case=order.label)
    named = truth if good else (str(rng.choice(sorted(CATALOGUE))),)
    off = float(rng.standard_normal())
    z = (Interval(truth[0], "share", off, abs(off) < 1.96),)
    return Score(order, truth, "explained", named, statement="It is so.", held_out=held, intervals=z, seconds=2.0)


def order(name, *without):
    return Order(name, without)
