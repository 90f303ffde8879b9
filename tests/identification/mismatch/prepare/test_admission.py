"""Which recordings go together, and with which twin: through the stage in a whole sentence, and each reason apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.prepare import stage
from identification.mismatch.prepare.admission import unfit
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.prepare.scales import scale_of
from identification.recording import Channel
from identification.run_history.remembered import RememberedRun
from identification.twin import Twin, TwinNoise, TwinTerm
from tests.identification.diagnosed_runs import TOP, C, run, table
from tests.identification.mismatch.small import history, short


def channel(quantity, unit, time, value):
    return Channel(quantity, quantity, quantity, unit, time, value)


def with_flow(recording):
    t = np.arange(0.0, 80.0, 1.0)
    return replace(recording, channels=(*recording.channels, channel("flow_speed", "m/s", t, 0.1 + t / 800)))


def twin(**changes):
    term = TwinTerm("speed_of_advance", "", {}, scale_of([RememberedRun(history(short()))], C))
    how = {"thruster": "T1", "driver_quantity": "command_voltage", "terms": (), **changes}
    if how["terms"]:
        how["terms"] = (term,)
    fixed = {"C": C, "names": ("C",), "covariance": ((0.0,),), "noise": TwinNoise(0.09, 0.0), "sources": ()}
    return Twin(**fixed, interval=0.1, highest_driver=TOP, **how)


def refused(recordings, holdout=(), baseline=None):
    found = stage.run(recordings, holdout, baseline)
    assert isinstance(found, Refusal), found
    return found.reason


def test_what_fits_together_is_prepared_in_the_order_given():
    runs, kept = [short(seed=2), short(seed=1)], [short(seed=3)]
    found = stage.run(runs, kept, twin())
    assert found.recordings == tuple(runs)
    assert [h.recording_id for h in found.histories] == [r.recording_id for r in runs]
    assert [h.recording_id for h in found.unseen] == [kept[0].recording_id]


def test_each_refusal_says_what_to_do():
    one = short(seed=1)
    other = short(seed=2, thruster="T9")
    t = np.arange(0.0, 80.0, 0.1)
    rate = channel("rotation_rate", "rev/s", t, 5 * np.sin(t / 5))
    by_rate = replace(short(seed=3), channels=(rate, short(seed=3).channels[1]))
    assert "hold out a recording of T1" in refused([one], [other])
    assert "both to be diagnosed and held out" in refused([one], [one])
    assert "driven by rotation_rate, the recordings to be diagnosed by command_voltage" in refused([one], [by_rate])
    assert "driven by different quantities" in refused([one, by_rate])
    assert "the same recording was given twice" in refused([one, one])
    assert "no recording was given" in refused([])
    assert "give the twin of T1" in refused([one], (), twin(thruster="T7"))
    assert "the twin is driven by rotation_rate" in refused([one], (), twin(driver_quantity="rotation_rate"))
    assert "the twin's speed_of_advance needs flow_speed" in refused([one], (), twin(terms=True))
    assert isinstance(stage.run([with_flow(one)], (), twin(terms=True)), stage.Prepared)


def test_too_few_samples_and_one_level_are_not_diagnosed():
    few = short(seconds=6.0, rate=5.0)
    assert "thrust samples, at least" in refused([few])
    flat = short()
    command, thrust = flat.channels
    hardly = replace(command, time=command.time - 1.0, value=5.0 + 1e-6 * (command.time > 9.0))
    flat = replace(flat, channels=(hardly, thrust))
    assert "at one level of command_voltage only" in refused([flat])


# ---------------------------------------------------------------- each reason apart


def reason(recordings, holdout=(), baseline=None):
    found = unfit(recordings, holdout, [history(r) for r in recordings], [history(r) for r in holdout], baseline)
    return None if found is None else found.reason


def test_what_goes_together_has_no_reason_against_it():
    runs, kept = [short(seed=1), short(seed=2)], [short(seed=3)]
    assert reason(runs) is None
    assert reason(runs, kept, twin()) is None


def test_the_first_of_several_reasons_is_told():
    """Another thruster is told before a twin of yet another."""
    said = reason([short(seed=1)], [short(seed=2, thruster="T9")], twin(thruster="T7"))
    assert said.startswith("run-2.h5 is of thruster T9")


def test_a_twin_is_held_against_what_is_held_out_too():
    one = with_flow(short(seed=1))
    assert reason([one], [], twin(terms=True)) is None
    assert "which run-T1-2 does not hold" in reason([one], [short(seed=2)], twin(terms=True))


def test_a_course_needs_so_many_samples_and_one_less_is_refused():
    """All samples at a tenth of a second from each other, of two levels."""
    least = int(policy.prepare.COURSE_SAMPLES)
    whole = run(seconds=30.0, rate=10.0)
    command, thrust = whole.channels
    first = int(np.searchsorted(thrust.time, 2.0))

    def lasting(samples):
        part = slice(first, first + samples)
        return replace(whole, channels=(command, replace(thrust, time=thrust.time[part], value=thrust.value[part])))

    assert reason([lasting(least)]) is None
    assert f"has {least - 1} thrust samples, at least {least}" in reason([lasting(least - 1)])


def test_a_table_of_levels_needs_no_more_than_its_levels():
    found = table(lambda v: C * v * np.abs(v), number=9)
    assert history(found).count.sum() == 9
    assert reason([found]) is None
