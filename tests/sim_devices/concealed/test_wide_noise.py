"""Noise drawn wide: each kind reaches its range, is what its name says, and moves no draw of the plain kinds."""

import json

import numpy as np
import pytest

from sim_devices import concealed
from sim_devices.concealed.cases.plans import KINDS, profile
from sim_devices.concealed.cases.wide_noise import Setting, usual_hold, wide_noise
from sim_devices.concealed.draw import noise_law
from sim_devices.concealed.sealing.on_disc import KINDS as ASKABLE
from sim_devices.world.noise_law import drawn

SETTING = Setting(std=0.1, rate=100.0, hold=5.0, run=450.0, thrust=50.0)


def rng(seed):
    return np.random.default_rng(seed)


def laws(kind, count=400):
    return [wide_noise(kind, SETTING, rng([7, i])) for i in range(count)]


def reach(values, low, high):
    """Within the range, and near both of its ends (in the logarithm)."""
    values = np.array(values)
    assert np.all((values >= low) & (values <= high))
    span = np.log(high / low)
    assert np.log(values.min() / low) < 0.05 * span
    assert np.log(high / values.max()) < 0.05 * span


def test_a_stand_rings_anywhere_with_one_to_twenty_per_cent():
    found = [law.peak for law in laws("wide_resonant")]
    reach([p.frequency for p in found], 1.0 / 5.0, 45.0)
    reach([p.width / (2.0 * p.frequency) for p in found], 0.01, 0.2)


def test_what_is_slow_has_a_fifth_of_a_hold_to_a_third_of_the_run():
    reach([law.slow[0].time_constant for law in laws("wide_slow")], 1.0, 150.0)


def test_what_is_proportional_is_up_to_five_times_the_rest():
    found = laws("wide_proportional")
    reach([law.proportional * 50.0 / law.white for law in found], 1.0, 5.0)


def test_unrest_after_steps_lasts_up_to_half_a_hold():
    found = laws("wide_near_steps")
    reach([law.unrest.decay for law in found], 0.1, 2.5)
    reach([law.unrest.share * 50.0 / law.white for law in found], 2.0, 20.0)


def test_quanta_are_smaller_and_larger_than_the_noise():
    found = laws("wide_quantised")
    reach([law.quantum / law.white for law in found], 0.5, 10.0)
    assert [float(law.white_std(np.zeros(1))[0]) for law in found] == pytest.approx([0.1] * len(found))


def test_a_mixture_is_of_two_to_four_parts_and_as_loud():
    def parts(law):
        return sum((law.proportional > 0.0, law.quantum > 0.0, bool(law.slow), law.peak is not None, bool(law.unrest)))

    found = laws("wide_mixture")
    assert {parts(law) for law in found} == {2, 3, 4}
    assert 0.25 < np.mean([law.tails > 0.0 for law in found]) < 0.42
    still = np.zeros(1)
    for law in found:
        power = law.white_std(still)[0] ** 2 + sum(s.std**2 for s in law.slow) + (law.peak.std**2 if law.peak else 0.0)
        assert np.sqrt(power) == pytest.approx(0.1)


@pytest.mark.parametrize("kind", ["wide_resonant", "wide_slow", "wide_quantised"])
def test_what_is_drawn_is_as_loud_as_asked(kind):
    law = wide_noise(kind, SETTING, rng(3))
    read = drawn(law, np.zeros(2_000_000), 100.0, rng(4))
    assert np.sqrt(np.var(read) + law.quantum**2 / 12.0) == pytest.approx(0.1, rel=0.1)


@pytest.mark.parametrize("kind", concealed.WIDE_NOISE_KINDS)
def test_a_clean_case_is_c_v_v_and_such_noise(kind):
    case = concealed.case(rng(5), noise=kind, sampling=50.0, duration=90.0)
    again = concealed.case(rng(5), noise=kind, sampling=50.0, duration=90.0)
    (found,) = concealed.rows(case)
    cell = next(c for c in found.columns if c.quantity == "thrust")
    assert np.array_equal(cell.value, next(c for c in concealed.rows(again)[0].columns if c.quantity == "thrust").value)
    told = json.loads(json.dumps(concealed.truth(case)))
    assert (told["noise_kind"], told["effects"]) == (kind, [])
    volts = case.runs[0].profile
    at = np.searchsorted(volts.time, cell.time, side="right") - 1
    clean = case.thruster.C * volts.volts[at] * np.abs(volts.volts[at]) + case.runs[0].tare
    assert np.std(cell.value - clean) < 0.1 * case.scale.thrust
    if told["noise"]["quantum"]:
        steps = cell.value / told["noise"]["quantum"]
        assert np.max(np.abs(steps - np.round(steps))) < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_the_usual_hold_is_a_hold_of_the_plan(kind):
    plan = profile(kind, 12.0, 400.0, 0.01, rng(2))
    assert min(s.end - s.start for s in plan.steps) <= usual_hold(plan) <= max(s.end - s.start for s in plan.steps)


def test_wide_kinds_are_asked_for_by_name_and_never_drawn():
    assert not set(concealed.NOISE_KINDS) & set(concealed.WIDE_NOISE_KINDS)
    assert ASKABLE["noise"] == list(concealed.NOISE_KINDS)
    assert ASKABLE["wide_noise"] == list(concealed.WIDE_NOISE_KINDS)
    drawn_kinds = {concealed.case(rng([1, i]), sampling=20.0, duration=60.0).noise_kind for i in range(60)}
    assert drawn_kinds == set(concealed.NOISE_KINDS)


BEFORE = {
    "white": (0.003419276725318417, -0.07387900314758065),
    "mixed": (-0.06281846194215485, 0.12012798071846616),
    "flicker": (0.08652407989345424, -0.05058346197713614),
    "slow": (0.15821317970629156, 0.1698461592909168),
    "heavy_tailed": (0.042950453816843946, 0.30366545514154425),
    "resonant": (0.021018707665395528, -0.01121574172354517),
}
"""First and last of 50 samples as they were drawn before there were wide kinds."""


@pytest.mark.parametrize("kind", concealed.NOISE_KINDS)
def test_the_plain_kinds_draw_what_they_drew(kind):
    seed = rng(11)
    law = noise_law(kind, 0.1, 50.0, seed)
    noise = drawn(law, np.linspace(-30.0, 30.0, 50), 50.0, seed)
    assert (noise[0], noise[-1]) == pytest.approx(BEFORE[kind], rel=1e-9)


def test_a_kind_that_is_not_known():
    with pytest.raises(ValueError, match="noise must be one of wide_resonant"):
        wide_noise("white", SETTING, rng(1))
    with pytest.raises(ValueError, match="wide_mixture, got 'pink'"):
        concealed.case(rng(1), noise="pink")
