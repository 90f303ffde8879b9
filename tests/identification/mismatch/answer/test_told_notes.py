"""What the answer says of channels that were not recorded, or in some of the recordings only."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.answer.proxies import proxies
from identification.mismatch.diagnosis import Diagnosis, Finding, RivalFinding
from identification.mismatch.model.model import Given, Model
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.channel_availability import held_by_all
from identification.mismatch.prepare.preparing import Refusal, history_of
from identification.mismatch.value import Value
from identification.physics.catalogue import CATALOGUE
from identification.physics.heating import Heating
from identification.recording import Channel
from rig.diagnose.text import diagnosis_text
from tests.identification.diagnosed_runs import run


def channel(quantity, unit, seconds, value, thruster=None):
    t = np.arange(0.0, seconds, 0.1)
    return Channel(quantity, quantity, quantity, unit, t, value(t) + np.zeros(t.size), thruster=thruster)


def flow(seconds):
    return channel("flow_speed", "m/s", seconds, lambda t: 0.5 * (np.floor(t / 10) % 3))


def in_flow(t, V, F):
    """0.8 N per V and m/s less."""
    return F - 0.8 * np.abs(V) * 0.5 * (np.floor(t / 10) % 3)


def found(effect, form="", rivals=(), parameters=None):
    return Finding(effect, form, "It is.", parameters or {}, 1e-9, 100.0, 1.0, rivals)


def told(*findings, extra=(), model=None):
    one = run(seconds=20.0, extra=extra)
    return proxies(model or Model(), findings, [one], [history_of(one)])


STANDS_IN = {
    "heating": (("heating", "winding"), ("motor_temperature", "degC"), "the power drawn before, the fourth power"),
    "recirculation": (("recirculation", "rate"), ("flow_speed", "m/s"), "the rotor's rate as the model has it"),
    "cavitation": (("cavitation", "linear"), ("rotation_rate", "rev/s"), "the voltage, as the steady rate"),
    "sag by energy": (("supply_sag", "discharge"), ("bus_voltage", "V"), "the energy drawn so far"),
    "sag by power": (("supply_sag", "loaded"), ("bus_voltage", "V"), "the power drawn, |V|^3,"),
    "torque": (("torque_crosstalk", ""), ("torque", "N.m"), "the square of the rotor's rate"),
}


@pytest.mark.parametrize("name", STANDS_IN)
def test_a_proxy_is_announced_where_the_channel_was_not_recorded(name):
    (effect, form), (quantity, unit), instead = STANDS_IN[name]
    (said,) = told(found(effect, form))
    assert said.startswith(f"{effect}: no ")
    assert instead in said
    assert said.endswith(" stands for it.")
    assert told(found(effect, form), extra=(channel(quantity, unit, 20.0, lambda t: 1.0 + t),)) == ()


def test_a_current_stands_for_the_thermometer_where_there_is_one():
    (said,) = told(found("heating", "magnet"), extra=(channel("current", "A", 20.0, lambda t: 1.0 + t),))
    assert said == (
        "heating: no motor temperature was recorded; the power drawn before, the recorded current squared, low-passed "
        "stands for it."
    )


def test_a_neighbour_by_its_command_and_turns_by_the_voltage():
    neighbour = channel("command_voltage", "V", 20.0, lambda t: 5.0 * (t > 9), "T2")
    (said,) = told(found("thruster_interaction"), extra=(neighbour,))
    assert said == "thruster_interaction: the neighbour's thrust was not recorded; V|V| of its command stands for it."
    measured = channel("thrust", "N", 20.0, lambda t: 5.0 * (t > 9), "T2")
    assert told(found("thruster_interaction"), extra=(neighbour, measured)) == ()
    line = found("periodic_disturbance", "locked", parameters={"periods_per_volt_second": Value(1.0, 0.1, "1/(V s)")})
    assert "integral of |V| stands for the rotor's turns" in told(line)[0]


def test_proxies_of_rivals_and_of_a_twin_are_told_once():
    rival = RivalFinding("heating", "winding", {}, 1.0, "It may be.")
    given = Model((Heating("magnet"),), (Given(Heating("winding"), (0.1, 20.0), None),))
    assert len(told(found("zero_drift", rivals=(rival,)), model=given)) == 1


def test_each_proxy_is_a_form_of_the_catalogue_that_does_without_the_quantity():
    without = [term for term in CATALOGUE if term.traits.proxy is not None]
    assert len(without) == 12
    assert all(term.traits.proxy.quantity not in term.needs for term in without)


def test_what_some_runs_lack_is_left_aside_and_said():
    temperature = channel("motor_temperature", "degC", 30.0, lambda t: 20.0 + t)
    whole = run(seed=1, seconds=30.0, extra=(flow(30.0), temperature))
    part = run(seed=2, seconds=30.0, extra=(temperature,))
    kept, notes = held_by_all([whole, part], [history_of(whole), history_of(part)])
    assert all(set(h.others) == {"motor_temperature"} for h in kept)
    assert notes == (
        "flow_speed was left aside: run-2.h5 has no such channel, and what explains the thrust must be recorded in "
        "every run.",
    )
    bare = [run(seed=n, seconds=30.0) for n in range(4)]
    _, (first, _) = held_by_all([whole, *bare], [history_of(r) for r in (whole, *bare)])
    assert first.startswith("flow_speed was left aside: 4 of 5 recordings have no such channel")
    assert held_by_all([whole], [history_of(whole)])[1] == ()


def test_the_answer_says_what_was_left_aside():
    answer = diagnose([run(seed=1, seconds=60.0, extra=(flow(60.0),)), run(seed=2, seconds=60.0)])
    assert isinstance(answer, Diagnosis)
    (note,) = answer.notes
    assert diagnosis_json(answer)["notes"] == [note]
    assert "flow_speed was left aside" in " ".join(diagnosis_text(answer).split())


def test_a_run_without_what_the_model_needs_is_not_predicted():
    bare, whole = run(in_flow, seed=1, seconds=60.0), run(in_flow, seed=2, seconds=60.0, extra=(flow(60.0),))
    fitted = run(in_flow, seconds=90.0, extra=(flow(90.0),))
    alone = diagnose([fitted], holdout=[bare])
    assert isinstance(alone, Diagnosis)
    assert [f.effect for f in alone.findings] == ["speed_of_advance"]
    assert "blocks of time" in alone.heldout.what
    assert alone.notes == (
        "run-1.h5 was held out, but cannot be predicted and judges nothing: it lacks flow_speed (speed_of_advance "
        "needs it).",
    )
    both = diagnose([fitted], holdout=[bare, whole])
    assert isinstance(both, Diagnosis)
    assert whole.recording_id in both.heldout.what
    assert bare.recording_id not in both.heldout.what


def test_a_run_held_out_must_be_driven_alike_and_hold_what_the_twin_looks_at():
    fitted, bare = run(in_flow, seconds=60.0, extra=(flow(60.0),)), run(seed=1, seconds=60.0)
    volts = bare.channels[0]
    turning = replace(volts, quantity="rotation_rate", unit="rev/s")
    other = diagnose([fitted], holdout=[replace(bare, channels=(turning, *bare.channels[1:]))])
    assert isinstance(other, Refusal)
    assert "run-1.h5 is driven by rotation_rate" in other.reason
    known = diagnose([fitted])
    assert isinstance(known, Diagnosis)
    refused = diagnose([run(seed=2, seconds=60.0, extra=(flow(60.0),))], holdout=[bare], baseline=known.twin)
    assert isinstance(refused, Refusal)
    assert "the twin's speed_of_advance needs flow_speed, which run-T1-1 does not hold" in refused.reason
