"""Each lie on cells made by hand: told where it is, and nothing where a thruster only does what thrusters do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.faults import stage
from identification.mismatch.faults.bad_values import missing, stuck
from identification.mismatch.faults.cells import Cells, cells_of
from identification.mismatch.faults.driver_laws import (
    impossible,
    midway,
    named_factor,
    reversed_channels,
    unsigned,
)
from identification.mismatch.faults.swaps import swapped_voltages, swaps
from identification.mismatch.prepare import stage as prepare
from identification.mismatch.prepare.preparing import Refusal
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import history, rng, short

N = 640


def levels(seed=0, n=N):
    return np.repeat(rng(seed).uniform(-1, 1, n // 16), 16)


def bench(seed=0, x=None, **changed):
    """What an honest bench gives: rate with the driver, thrust and current with its square, a bus that is neither."""
    x = levels(seed) if x is None else x
    e = rng([seed, 9])
    values = {
        "thrust": 40 * x * np.abs(x) + 1 + 0.4 * e.standard_normal(x.size),
        "rotation_rate": 20 * x + 0.1 * e.standard_normal(x.size),
        "current": 6 * x * np.abs(x) + 0.05 * e.standard_normal(x.size),
        "bus_voltage": 24 - x**2 + 0.02 * e.standard_normal(x.size),
        "flow_speed": 0.02 * e.standard_normal(x.size),
    }
    values |= {q: change(values) for q, change in changed.items()}
    x = x / np.max(np.abs(x))
    return Cells(Recording("r", "T", ()), "command_voltage", 0.1 * np.arange(x.size), x, 12.0, values)


def told(found, alarm=1e-4):
    """Quantities that were accused."""
    return [f[0] for f in found if f[2] < alarm]


@pytest.mark.parametrize("seed", range(6))
def test_an_honest_bench_is_accused_of_nothing(seed):
    here = bench(seed)
    assert told(impossible(here)) == told(midway(here)) == told(unsigned(here)) == []
    assert told(reversed_channels(here, set())) == []
    assert [s for s in swaps(here) if s[3] < 1e-4] == []


# ---------------------------------------------------------------- one channel against the driver


def test_a_sign_that_is_reversed_is_told_of_the_channel_or_of_the_driver():
    one = bench(thrust=lambda v: -v["thrust"])
    assert told(reversed_channels(one, set())) == ["thrust"]
    every = bench(**{q: lambda v, q=q: -v[q] for q in ("thrust", "rotation_rate", "current")})
    ((quantity, says, p, _),) = reversed_channels(every, set())
    assert (quantity, p < 1e-6) == ("command_voltage", True)
    assert "its sign is reversed" in says
    assert told(reversed_channels(one, {"thrust"})) == [], "what is known to lie in another way is not asked"


def test_a_lonely_channel_of_the_wrong_sign_may_be_the_driver():
    alone = replace(bench(thrust=lambda v: -v["thrust"]), values={"thrust": -bench().values["thrust"]})
    ((_, says, _, values),) = reversed_channels(alone, set())
    assert says.endswith("or that of the driver: no other channel tells which.")
    assert values["slope"].value < 0


@pytest.mark.parametrize("quantity", ["thrust", "rotation_rate", "current"])
def test_a_channel_that_lost_its_sign(quantity):
    assert told(unsigned(bench(**{quantity: lambda v: np.abs(v[quantity])}))) == [quantity]


def test_one_way_alone_tells_no_sign():
    """Driven forwards only, the size is the value."""
    assert told(unsigned(bench(x=np.abs(levels()), thrust=lambda v: np.abs(v["thrust"])))) == []


def test_an_asymmetry_is_no_lost_sign():
    """Half the thrust backwards is physics."""
    here = bench(thrust=lambda v: np.where(v["thrust"] < 0, 0.5, 1.0) * v["thrust"])
    assert told(unsigned(here)) == told(reversed_channels(here, set())) == []


@pytest.mark.parametrize(("factor", "what"), [(1 / 9.80665, "kilogram"), (60.0, "per minute"), (2.0, "factor of two")])
def test_a_scale_that_changes_midway(factor, what):
    quantity = "rotation_rate" if factor == 60.0 else "thrust"
    late = np.arange(N) >= 384
    here = bench(**{quantity: lambda v: np.where(late, factor, 1.0) * v[quantity]})
    ((named, says, p, values),) = midway(here)
    assert named == quantity
    assert p < 1e-6
    assert values["factor"].value == pytest.approx(factor, rel=0.03)
    assert abs(values["factor"].value - factor) < 5 * values["factor"].std + 1e-3 * factor
    assert values["start"].value == pytest.approx(38.4, abs=0.3)
    assert what in says


def test_all_channels_at_once_is_the_rotor_and_no_lie():
    """A propeller that came off: thrust and current alike, at one time."""
    late = np.arange(N) >= 384
    both = {q: lambda v, q=q: np.where(late, 0.1, 1.0) * v[q] for q in ("thrust", "current")}
    assert list(midway(bench(**both))) == []


def test_a_gain_that_drifts_is_no_change_of_scale():
    here = bench(thrust=lambda v: v["thrust"] * np.linspace(1.0, 0.7, N))
    assert list(midway(here)) == []


def test_sizes_that_no_channel_has_in_its_unit():
    assert told(impossible(bench(rotation_rate=lambda v: 60 * v["rotation_rate"]))) == ["rotation_rate"]
    ((quantity, says, _, values),) = impossible(bench(bus_voltage=lambda v: 1000 * v["bus_voltage"]))
    assert (quantity, values["factor"].value) == ("bus_voltage", 1000.0)
    assert "milli" in says
    ((quantity, says, _, values),) = impossible(bench(bus_voltage=lambda v: 1e-3 * v["bus_voltage"]))
    assert (quantity, values["factor"].value) == ("bus_voltage", 0.001)
    assert "kilo" in says
    rate = replace(bench(bus_voltage=lambda v: 1000 * v["bus_voltage"]), driver_quantity="rotation_rate")
    assert list(impossible(rate)) == [], "nothing tells how many volts a rate wants"


def test_a_factor_of_units_is_named_whichever_way_round():
    assert named_factor(59.2) == (60.0, "per minute for per second")
    assert named_factor(1 / 9.9)[0] == pytest.approx(1 / 9.80665)
    assert named_factor(1.37) == (1.37, "")


def test_levels_that_were_not_seen_before_say_nothing_of_a_change_of_scale():
    """Of a course that begins with three levels: a cubic through them is anything elsewhere."""
    x = np.concatenate([np.repeat([0.0, 0.8, -0.8], 40), np.repeat(np.tile([0.6, -0.6, 0.35, -0.35, 0.2], 8), 13)])
    here = bench(x=x, current=lambda v: v["current"] * np.where(np.arange(x.size) < 120, 1.0, 0.9))
    assert told(midway(here)) == []


# ---------------------------------------------------------------- swaps


def exchanged(a, b):
    return {a: lambda v: v[b], b: lambda v: v[a]}


@pytest.mark.parametrize(
    ("a", "b"),
    [("rotation_rate", "thrust"), ("rotation_rate", "current"), ("rotation_rate", "bus_voltage")],
)
def test_two_that_follow_each_others_law_are_swapped(a, b):
    honest = bench()
    values = {**honest.values, a: honest.values[b], b: honest.values[a]}
    found = [s for s in swaps(replace(honest, values=values)) if s[3] < 1e-4]
    assert found[0][:2] == (a, b)
    assert found[0][2].endswith("they are swapped.")


def test_two_of_the_same_law_cannot_be_told():
    honest = bench()
    values = {**honest.values, "thrust": honest.values["current"], "current": honest.values["thrust"]}
    assert [s for s in swaps(replace(honest, values=values)) if s[3] < 1e-4] == []


def test_a_flow_that_is_a_supply():
    honest = bench()
    values = {**honest.values, "flow_speed": honest.values["bus_voltage"], "bus_voltage": honest.values["flow_speed"]}
    assert any(s[:2] == ("flow_speed", "bus_voltage") and s[3] < 1e-4 for s in swaps(replace(honest, values=values)))


def voltages(seconds=80.0):
    """A command that rests at levels and a motor voltage that was measured."""
    run = short(seconds=seconds)
    command = run.channels[0]
    t = np.arange(0.0, seconds, 0.05)
    V = command.held_at(t)
    V = np.nan_to_num(V) * 0.97 + 0.02 * rng(5).standard_normal(t.size)
    motor = Channel("motor", "esc", "motor_voltage", "V", t, V)
    dense = replace(command, time=t, value=np.nan_to_num(command.held_at(t)))
    return replace(run, channels=(dense, run.channels[1], motor))


def test_command_and_motor_voltage_are_told_by_who_rests():
    honest = voltages()
    assert swapped_voltages(honest) == []
    command, thrust, motor = honest.channels
    crossed = (
        replace(command, time=motor.time, value=motor.value),
        thrust,
        replace(motor, time=command.time, value=command.value),
    )
    ((a, b, says, p),) = swapped_voltages(replace(honest, channels=crossed))
    assert (a, b, p) == ("command_voltage", "motor_voltage", 0.0)
    assert "never rests" in says
    unrelated = replace(crossed[2], value=rng(6).permutation(crossed[2].value))
    assert swapped_voltages(replace(honest, channels=(*crossed[:2], unrelated))) == []


# ---------------------------------------------------------------- bad values


def spoiled(change):
    run = short(rate=20.0)
    command, thrust = run.channels
    return replace(run, channels=(command, replace(thrust, value=change(thrust))))


def test_a_channel_that_gives_no_numbers_is_told_with_its_longest_gap():
    gone = spoiled(lambda c: np.where((c.time > 30) & (c.time < 50), np.nan, c.value))
    ((quantity, says, values),) = missing(gone)
    assert quantity == "thrust"
    assert values["share"].value == pytest.approx(0.25, abs=0.01)
    assert (values["start"].value, values["end"].value) == pytest.approx((30.05, 50.0), abs=0.06)
    assert "30.05 s to 50 s" in says
    ((_, says, values),) = missing(spoiled(lambda c: np.nan * c.value))
    assert (says, values["share"].value) == ("thrust holds no number at all.", 1.0)
    assert list(missing(short())) == []
    assert list(missing(spoiled(lambda c: np.where(c.time < 2, np.nan, c.value)))) == [], "it began a little late"
    assert list(missing(spoiled(lambda c: np.where(np.arange(c.time.size) == 70, np.nan, c.value)))) == []


def test_a_channel_that_stands_still_while_the_drive_moves_is_frozen():
    run = spoiled(lambda c: np.where(c.time > 50, 33.0, c.value))
    ((quantity, found),) = stuck(run, cells_of(run))
    assert quantity == "thrust"
    assert found.p_value < 1e-12
    assert found.at.value == 33.0
    assert (found.start, found.end) == pytest.approx((50.05, 79.95), abs=0.06)
    assert (found.start_value.value, found.end_value.unit) == (found.start, "s")
    assert "it is frozen" in found.statement


@pytest.mark.parametrize(
    "change",
    [
        lambda c: c.value,
        lambda c: np.clip(c.value, -30.0, 30.0),
        lambda c: np.round(c.value / 8.0) * 8.0,
        lambda c: np.where((c.time > 50) & (c.time < 50.4), 33.0, c.value),
    ],
    ids=["honest", "clipped", "coarse", "shortly"],
)
def test_what_repeats_for_another_reason_is_not_frozen(change):
    run = spoiled(change)
    assert all(s.p_value > 1e-4 for _, s in stuck(run, cells_of(run)))


# ---------------------------------------------------------------- the stage


def test_what_lies_gravely_is_put_right_and_what_does_not_is_left():
    honest = short(rate=20.0)
    reversed_ = spoiled(lambda c: -c.value)
    prepared = prepare.run([reversed_], [short(seed=3)], None)
    sound = stage.run(prepared)
    assert [f.kind for f in sound.faults] == ["reversed"]
    (right,) = sound.histories
    assert np.nan_to_num(right.thrust) == pytest.approx(np.nan_to_num(history(honest).thrust))
    assert sound.unseen == prepared.unseen, "what is honest stays the very same"
    assert sound.notes == ()
    clean = prepare.run([honest], (), None)
    assert stage.run(clean).histories == clean.histories


def test_what_cannot_be_diagnosed_once_it_is_put_right_is_refused():
    """Frozen throughout: nothing is left."""
    prepared = prepare.run([spoiled(lambda c: np.full(c.value.size, 5.0))], (), None)
    assert isinstance(prepared, prepare.Prepared)
    found = stage.run(prepared)
    assert isinstance(found, Refusal), [f.kind for f in found.faults]
    assert "thrust" in found.reason
