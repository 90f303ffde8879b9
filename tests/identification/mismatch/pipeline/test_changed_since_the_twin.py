"""What a twin has with other values: told as a change of it, whichever way, and not as physics beside it."""

import numpy as np
import pytest

from identification.mismatch.pipeline import diagnose
from tests.identification.diagnosed_runs import dead_band, levels, run
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed, effects, within

SECONDS = 120.0


def worn(width, tau, seed, ratio=1.0):
    """A dead band of `width` V, and a rotor that follows it with `tau` s."""
    start, level = levels(seed, SECONDS)
    wanted = dead_band(width)(level)

    def thrust(t, _V, _F):
        x, at = np.zeros_like(t), 0.0
        for begin, end, target in zip(start, [*start[1:], SECONDS + 1.0], wanted, strict=True):
            inside = (t >= begin) & (t < end)
            x[inside] = target + (at - target) * np.exp(-(t[inside] - begin) / tau)
            at = target + (at - target) * np.exp(-(end - begin) / tau)
        return 0.5 * x * np.abs(x) * np.where(x < 0, ratio, 1.0)

    return run(thrust, seed=seed, seconds=SECONDS, rate=20.0)


@pytest.fixture(scope="module")
def twin():
    found = diagnosed(worn(1.5, 0.2, 0))
    assert effects(found) == {"dead_band", "motor_lag"}
    return found.twin


@pytest.mark.parametrize(
    ("width", "tau", "effect", "name", "now"),
    [
        (1.5, 0.16, "motor_lag", "time_constant", 0.16),
        (1.5, 0.25, "motor_lag", "time_constant", 0.25),
        (1.2, 0.2, "dead_band", "half_width", 1.2),
        (1.8, 0.2, "dead_band", "half_width", 1.8),
    ],
)
def test_a_value_that_changed_is_found_alone(twin, width, tau, effect, name, now):
    found = diagnose([worn(width, tau, 1)], baseline=twin)
    assert found.verdict == "explained", found.statement
    (finding,) = found.findings
    assert finding.effect == effect
    within(finding.parameters[name], now, rel=0.01)
    assert finding.before[name].value == pytest.approx({"motor_lag": 0.2, "dead_band": 1.5}[effect], rel=0.02)
    assert found.statement.startswith("Changed: ")
    assert f"has it with {name.replace('_', ' ')}" in found.statement
    assert found.model_terms == tuple(t.effect for t in found.twin.terms), "it stands in its place, not beside it"
    assert found.model[f"{effect}.{name}"] == finding.parameters[name]


def test_what_is_new_is_found_beside_what_the_twin_has(twin):
    found = diagnose([worn(1.5, 0.2, 1, ratio=0.8)], baseline=twin)
    assert effects(found) == {"asymmetry"}, found.statement
    assert not found.findings[0].before
    assert found.statement.startswith("Missing from the model: ")


def test_nothing_changed_is_adequate(twin):
    assert diagnose([worn(1.5, 0.2, 2)], baseline=twin).verdict == "adequate"
