"""Concealed cases: the strength is what the formula says, the effect changes what it should, the seed repeats."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sim_devices import concealed
from sim_devices.concealed.cases.definition import history
from sim_devices.concealed.cases.plans import held, profile
from sim_devices.concealed.cases.shapes import shape
from sim_devices.concealed.visibility.oracle import with_amount
from sim_devices.concealed.visibility.projection import history_volts
from sim_devices.concealed.visibility.rivals import BOTH_SIGNS
from sim_devices.concealed.visibility.whitening import Whitening
from sim_devices.world.noise_law import NoiseLaw, Peak, Slow, Unrest, drawn, peak_coefficients
from tests.concealed.recordings import recording, recordings

SHORT = {"duration": 90.0, "sampling": 40.0, "plan": "interleaved"}
CELL = {  # act behind the propeller: no other channel may know of them
    "strut_drag",
    "torque_crosstalk",
    "stand_resonance",
    "hysteresis",
    "time_skew",
    "load_cell_creep",
    "load_cell_nonlinearity",
    "load_cell_even_bend",
    "load_cell_saturation",
    "periodic_disturbance",
    "zero_drift",
    "zero_offset",
}


def rng(seed=1):
    return np.random.default_rng(seed)


def columns(case):
    return {(c.stream, c.quantity): c for c in concealed.rows(case)[0].columns}


def test_a_clean_recording_is_c_v_v_one_zero_and_its_noise():
    case = concealed.case(rng(), noise="white", duration=300.0)
    found = columns(case)
    thrust, command = found["cell", "thrust"], found["command", "command_voltage"]
    at = np.searchsorted(command.time, thrust.time, side="right") - 1  # as any reader would
    volts = command.value[at]
    rest = thrust.value - case.thruster.C * volts * np.abs(volts) - case.runs[0].tare
    assert np.std(rest) == pytest.approx(case.noise.white, rel=0.05)
    assert np.max(np.abs(rest)) < 6.0 * case.noise.white  # not one sample on the wrong side of a step


def test_no_sample_is_taken_at_the_instant_of_a_change():
    for seed, kind in enumerate(concealed.PLAN_KINDS):
        case = concealed.case(rng(seed), plan=kind, duration=120.0)
        found = columns(case)
        samples, changes = found["cell", "thrust"].time, found["command", "command_voltage"].time[1:]
        after = np.clip(np.searchsorted(samples, changes), 1, samples.size - 1)
        gaps = np.minimum(np.abs(samples[after] - changes), np.abs(changes - samples[after - 1]))
        assert np.min(gaps) > 0.4 * case.dt


@pytest.mark.parametrize("effect", concealed.SHAPES)
def test_each_effect_is_as_strong_as_asked_and_changes_what_it_should(effect):
    plan = {} if effect in ("dead_band", "thermal_derating") else {"plan": SHORT["plan"]}
    case = concealed.case(rng(3), [effect], 40.0, noise="white", sampling=40.0, duration=200.0, **plan)
    assert concealed.strength(case, effect) == pytest.approx(40.0, rel=1e-3)
    clean = columns(replace(case, effects=()))
    found = columns(case)
    assert np.max(np.abs(found["cell", "thrust"].value - clean["cell", "thrust"].value)) > 0.0
    if effect in CELL:
        for key in found.keys() - {("cell", "thrust")}:
            assert np.array_equal(found[key].value, clean[key].value)
    told = json.loads(json.dumps(concealed.truth(case)))
    assert told["effects"][0]["d_prime"] == pytest.approx(40.0, rel=1e-3)


SHOWN_BY = {"water_column": "momentum", "blades_resonant": "resonance", "before_noise": "place"}
"""Variant -> the word of the world's parameters that tells it; else it has the same name there."""


@pytest.mark.parametrize(("effect", "form"), [(e, f) for e, forms in concealed.VARIANTS.items() for f in forms])
def test_a_variant_is_there_when_asked_for_and_as_strong(effect, form):
    case = concealed.case(rng(3), [effect], 40.0, forms=[form], noise="white", sampling=40.0, duration=200.0)
    assert concealed.strength(case, effect) == pytest.approx(40.0, rel=1e-3)
    parameters = case.effects[0].parameters
    assert SHOWN_BY.get(form, form) in (*parameters, *parameters.values())
    assert form not in concealed.FORMS.get(effect, ())  # never drawn by chance


def test_the_strength_of_a_linear_effect_is_the_formula():
    case = concealed.case(rng(5), ["linear_term"], 15.0, noise="white", **SHORT)
    volts = history_volts(case, 0)
    basis = np.column_stack([volts * np.abs(volts), np.ones_like(volts)])
    x = case.effects[0].parameters["coefficient"] * volts
    left = x - basis @ np.linalg.lstsq(basis, x, rcond=None)[0]
    assert concealed.strength(case, "linear_term") == pytest.approx(np.linalg.norm(left) / case.noise.white, rel=1e-6)
    doubled = with_amount(case, "linear_term", 2.0 * case.effects[0].amount)
    assert concealed.strength(doubled, "linear_term") == pytest.approx(30.0, rel=1e-3)


def test_an_oracle_sees_what_it_should_in_noise_that_is_drawn():
    """The matched statistic of many noises has mean d' and unit spread."""
    case = concealed.case(rng(6), ["zero_offset"], 5.0, noise="mixed", **SHORT)
    h = history(case, case.runs[0])
    clean = history(case, case.runs[0], without=frozenset({"zero_offset"}))
    x = (h.reading - clean.reading)[case.first :: case.every]
    value = h.reading[case.first :: case.every]
    weights = Whitening(case.noise, value, case.rate).solve(x[:, None])[:, 0]
    seen = np.array([weights @ (x + drawn(case.noise, value, case.rate, rng(s))) for s in range(300)])
    assert np.std(seen) ** 2 / np.mean(seen) == pytest.approx(1.0, abs=0.25)


def test_whitening_is_the_inverse_of_the_covariance():
    n, rate = 80, 20.0
    unrest = Unrest(0.02, 0.4, 0.3)
    law = NoiseLaw(
        0.1, 0.01, slow=(Slow(0.2, 0.5), Slow(0.3, 3.0)), peak=Peak(0.2, 3.0, 0.2), unrest=unrest, quantum=0.3
    )
    value = 10.0 * rng(1).standard_normal(n)
    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    a, b, _ = peak_coefficients(law.peak, rate)
    correlation = [1.0, a / (1.0 - b)]
    for _ in range(n - 2):
        correlation.append(a * correlation[-1] + b * correlation[-2])
    covariance = np.diag(law.white_std(value) ** 2) + law.peak.std**2 * np.array(correlation)[lag]
    size = unrest.size(value, rate)
    covariance += np.outer(size, size) * np.exp(-lag / rate / unrest.time_constant)
    for slow in law.slow:
        covariance += slow.std**2 * np.exp(-lag / rate / slow.time_constant)
    x = rng(2).standard_normal((n, 3))
    assert Whitening(law, value, rate).solve(x) == pytest.approx(np.linalg.solve(covariance, x), rel=1e-8)


@pytest.mark.parametrize("noise", [*concealed.NOISE_KINDS, *concealed.WIDE_NOISE_KINDS])
def test_every_noise_kind_can_hide_an_effect(noise):
    case = concealed.case(rng(8), ["asymmetry"], 8.0, noise=noise, **SHORT)
    assert case.noise_kind == noise
    assert concealed.strength(case, "asymmetry") == pytest.approx(8.0, rel=1e-3)


def test_the_same_seed_is_the_same_case():
    one, two, other = (concealed.case(rng(s), ["heating"], 15.0, duration=90.0) for s in (9, 9, 10))
    assert json.dumps(concealed.truth(one)) == json.dumps(concealed.truth(two))
    first, second = columns(one), columns(two)
    assert all(np.array_equal(first[key].value, second[key].value) for key in first | second)
    assert json.dumps(concealed.truth(one)) != json.dumps(concealed.truth(other))


def test_a_pair_is_measured_with_both_there():
    case = concealed.case(rng(11), ["asymmetry", "linear_term"], 20.0, forms=["strong_reverse"], **SHORT)
    told = {e["effect"]: e for e in concealed.truth(case)["effects"]}
    assert {name: e["d_prime"] for name, e in told.items()} == pytest.approx(
        {"asymmetry": 20.0, "linear_term": 20.0}, rel=0.05
    )
    assert told["asymmetry"]["parameters"]["ratio"] > 1.0


def test_several_runs_have_one_thruster_and_a_zero_each():
    case = concealed.case(rng(12), ["gain_step"], 15.0, runs=2, channels=["rotation_rate"], **SHORT)
    found = recordings(case)
    assert len({r.recording_id for r in found}) == 2
    assert {r.thruster for r in found} == {"T"}
    assert case.runs[0].tare != case.runs[1].tare
    assert [c.quantity for c in found[0].channels] == ["command_voltage", "thrust", "rotation_rate"]


def test_a_recording_has_its_steps_and_a_neighbour_its_own_command():
    case = concealed.case(rng(13), ["thruster_interaction"], 40.0, **SHORT)
    found = recording(replace(case, with_steps=True))
    assert {s.phase for s in found.steps} >= {"tare", "hold", "rest"}
    assert all(s.t_end >= s.t_start for s in found.steps)
    own, other = found.all_of("command_voltage")
    assert (own.thruster, other.thruster) == (None, "neighbour")
    assert np.unique(other.value).size == 2
    assert recording(replace(case, with_steps=False)).steps == ()


@pytest.mark.parametrize("lie", concealed.LIES)
def test_a_lie_changes_the_channel_it_is_about(lie):
    case = concealed.case(rng(14), lie=lie, **SHORT)
    told, found, clean = concealed.truth(case)["fault"], columns(case), columns(replace(case, fault=None))
    changed = {q for (_, q), c in found.items() if not np.array_equal(c.value, clean[_, q].value)}
    assert changed == {told["channel"], told.get("other", told["channel"])}


@pytest.mark.parametrize("kind", concealed.PLAN_KINDS)
def test_a_plan_lasts_as_asked_and_keeps_to_its_volts(kind):
    found = profile(kind, 24.0, 300.0, 0.004, rng(15))
    assert 270.0 < found.duration < 390.0
    assert np.all(np.diff(found.time) > 0.0)
    assert 0.8 * 24.0 < np.max(np.abs(found.volts)) <= 24.0 + 1e-9
    assert (np.min(found.volts), found.volts[0], found.volts[-1]) == (pytest.approx(-24.0, rel=0.25), 0.0, 0.0)
    assert held(found.time, found.volts, found.time + 0.001) == pytest.approx(found.volts)


def test_twins_are_near_and_strangers_are_far():
    case = concealed.case(rng(16), ["winding_resistance"], 40.0, noise="white", channels=[], **SHORT)
    case = replace(case, runs=(replace(case.runs[0], flow=((0.0, 0.0),)),))
    rivals = ["strut_drag", "temperature_squared", "exponent", "periodic_disturbance", "winding_resistance"]
    left = {twin.rival: twin.left for twin in concealed.twins(case, "winding_resistance", rivals, rng(17))}
    assert left.keys() == {"exponent", "periodic_disturbance"}  # no flow, no drift, not itself
    assert left["exponent"] < 0.5 * 40.0 < 0.95 * 40.0 < left["periodic_disturbance"] <= 40.0 * 1.05


@pytest.mark.parametrize("effect", concealed.SHAPES)
def test_an_amount_that_is_drawn_with_either_sign_may_have_either_sign_as_a_rival(effect):
    scale = concealed.case(rng(18), **SHORT).scale
    for form in concealed.FORMS.get(effect, ("",)):
        signs = {np.sign(shape(effect, scale, rng(seed), form).gain) for seed in range(20)}
        assert len(signs) == 1 or effect in BOTH_SIGNS


def test_names_that_are_not_known_and_strengths_that_cannot_be():
    with pytest.raises(ValueError, match="effect must be one of"):
        concealed.case(rng(), ["deadband"])
    with pytest.raises(ValueError, match="form of dead_band must be one of shrink, jump"):
        concealed.case(rng(), ["dead_band"], forms=["wide"])
    with pytest.raises(ValueError, match="plan must be one of"):
        concealed.case(rng(), plan="stairs")
    with pytest.raises(ValueError, match="noise must be one of"):
        concealed.case(rng(), noise="pink")
    with pytest.raises(ValueError, match="channels: expected some of"):
        concealed.case(rng(), channels=["thrst"])
    with pytest.raises(ValueError, match="fault must be one of"):
        concealed.case(rng(), lie="fib", **SHORT)
    with pytest.raises(concealed.OutOfReach, match="expected a lower strength"):
        concealed.case(rng(), ["heating"], 1e6, sampling=20.0, duration=60.0, plan="interleaved")
    with pytest.raises(ValueError, match="strength: expected one of"):
        concealed.strength(concealed.case(rng(), **SHORT), "heating")
