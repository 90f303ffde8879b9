"""The guard: every reason to stop, and none without one."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.protocols import Channel, LinkHealth, Stream
from rig.campaign.config import LimitConfig
from rig.campaign.limits import GuardedChannel, guarded_channels
from rig.safety.guard import Allowances, Latest, Recorder, Trip, Vitals, allowances, check

CELL = Stream("load_cell", "mt_sics", (Channel("thrust", "thrust", "N"), Channel("stable", None, "1")), 1 / 92)
FLOW = Stream("flow", "nortek", (Channel("flow_speed", "flow_speed", "m/s"),), 0.25)
THRUST = GuardedChannel("load_cell.thrust", "N", 0.2, -300.0, 300.0)
ALLOWED = Allowances()
GOOD = LinkHealth(True, 1, 0, ())


def ask(value: float = 1.0, at: float = 10.0, watch: GuardedChannel = THRUST, **vitals) -> Trip | None:
    facts = {"now": 10.0, "started": 0.0} | vitals
    return check((watch,), {watch.channel: Latest(value, at)}, Vitals(**facts), ALLOWED)


def test_all_is_well():
    recorder = Recorder(silence=0.3, free_bytes=2**30)
    assert ask(lateness=0.1, links={"motor": GOOD}, recorder=recorder, lease_age=0.5) is None
    assert ask(-300.0) is None
    assert ask(300.0) is None


@given(st.floats())
def test_a_value_passes_only_inside_its_limits(value):
    trip = ask(value)
    assert (trip is None) == (-300.0 <= value <= 300.0)
    assert trip is None or (trip.kind, trip.channel) == ("cut", "load_cell.thrust")


@pytest.mark.parametrize("limits", [{"min": 0.0}, {"max": 0.0}, {"min": -inf, "max": inf}, {}])
def test_nan_fails_every_limit(limits):
    trip = ask(nan, watch=GuardedChannel("load_cell.thrust", "N", 0.2, **limits))
    assert trip is not None
    assert trip.source == "nan"


def test_trip_names_channel_value_and_limit():
    trip = ask(301.5)
    assert trip == Trip(
        "load_cell.thrust is 301.5 N, above its limit of 300 N", "limit", 10.0, "load_cell.thrust", 301.5, 300.0
    )
    assert ask(-301.5).cause == "load_cell.thrust is -301.5 N, below its limit of -300 N"


@given(st.floats(0, 5))
def test_a_sample_that_is_too_old_trips(age):
    trip = ask(at=10.0 - age)
    assert (trip is None) == (10.0 - (10.0 - age) <= 0.2)
    assert trip is None or trip.source == "stale"


def test_silence_is_allowed_for_the_grace_only():
    def silent(now: float) -> Trip | None:
        return check((THRUST,), {}, Vitals(now, started=8.0), ALLOWED)

    assert silent(10.0) is None
    assert silent(10.1).cause == "load_cell.thrust gave no sample in 2.10 s since the start, 2 s are allowed"


@pytest.mark.parametrize(
    ("vitals", "source", "text"),
    [
        ({"links": {"motor": LinkHealth(False, 9, 0, (), "the cable was pulled")}}, "link", "the cable was pulled"),
        ({"links": {"cell": GOOD, "motor": LinkHealth(False, 9, 0, ())}}, "link", "to motor is gone: its reader"),
        ({"lateness": 0.3}, "late", "0.30 s late, 0.25 s are allowed"),
        ({"recorder": Recorder("the recorder process has ended")}, "recorder", "recorder: the recorder process has"),
        ({"recorder": Recorder(silence=16.0)}, "recorder", "nothing was flushed for 16 s"),
        ({"recorder": Recorder(free_bytes=2**20)}, "recorder", "only 1 MiB left"),
        ({"ledger_error": "campaign.jsonl: the disk is full"}, "recorder", "campaign.jsonl: the disk is full"),
        ({"lease_age": 2.5}, "lease", "no operator was seen for 2.5 s"),
        ({"lease_age": inf}, "lease", "no operator"),
    ],
)
def test_the_rig_itself_is_guarded(vitals, source, text):
    trip = ask(**vitals)
    assert trip.source == source
    assert text in trip.cause


def test_the_bench_is_named_before_the_rig():
    assert ask(400.0, lateness=1.0).source == "limit"


def test_nothing_hides_that_nothing_is_saved():
    gone = Recorder("the recorder process has ended")
    assert ask(at=1.0).source == "stale"
    assert ask(at=1.0, lateness=1.0, recorder=gone).source == "recorder"


def test_a_recorder_that_is_slow_is_no_reason_to_stop():
    assert ask(recorder=Recorder(silence=14.9, free_bytes=ALLOWED.free_bytes)) is None


def test_watches_take_their_defaults_from_the_streams():
    limits = [LimitConfig("load_cell.thrust", max=5.0), LimitConfig("flow.flow_speed", max_age=9.0)]
    found = guarded_channels(limits, (CELL, FLOW), essential=("load_cell.thrust", "load_cell.stable"))
    assert found == (
        GuardedChannel("load_cell.thrust", "N", 0.2, None, 5.0),
        GuardedChannel("flow.flow_speed", "m/s", 9.0),
        GuardedChannel("load_cell.stable", "1", 0.2),
    )
    assert guarded_channels([LimitConfig("flow.flow_speed")], (FLOW,))[0].max_age == 0.75  # three periods


def test_an_emergency_stop_input_is_always_watched():
    stream = Stream("button", "line_stream", (Channel("emergency_stop", "emergency_stop", "1"),), 0.05)
    for limits in ([], [LimitConfig("button.emergency_stop", max=9.0)]):
        (watch,) = guarded_channels(limits, (stream,))
        assert watch.stops
        assert check([watch], {watch.channel: Latest(0.0, 9.99)}, Vitals(10.0, 0.0), Allowances()) is None
        for value in (1.0, -1.0, 0.5):
            trip = check([watch], {watch.channel: Latest(value, 9.99)}, Vitals(10.0, 0.0), Allowances())
            assert (trip.source, trip.value) == ("emergency_stop", value)
            assert trip.cause.startswith("EMERGENCY STOP: button.emergency_stop")
        assert check([watch], {watch.channel: Latest(0.0, 9.5)}, Vitals(10.0, 0.0), Allowances()).source == "stale"
        assert check([watch], {watch.channel: None}, Vitals(10.0, 0.0), Allowances()).source == "stale"


def test_unknown_channel_is_named():
    with pytest.raises(ValueError, match=r"no device gives a channel flow\.speed; there are flow\.flow_speed"):
        guarded_channels([LimitConfig("flow.speed")], (FLOW,))


def test_lateness_follows_the_loop_rate():
    assert allowances(50.0).lateness == 0.25
    assert allowances(10.0).lateness == 0.5


FROZEN = GuardedChannel("load_cell.thrust", "N", 0.2, max_frozen=0.0)


@pytest.mark.parametrize(
    ("watch", "same", "longest", "driven", "trips"),
    [
        (FROZEN, 1.9, 0.02, 5.0, False),  # 2 s at least
        (FROZEN, 2.1, 0.02, 5.0, True),
        (FROZEN, 2.1, 0.3, 9.0, False),  # its digit has stood still for 0.3 s before: 6 s
        (FROZEN, 6.1, 0.3, 9.0, True),
        (FROZEN, 9.0, None, 20.0, False),  # it has never changed: 10 s
        (FROZEN, 10.1, None, 20.0, True),
        (FROZEN, 60.0, 0.02, 0.0, False),  # at rest a sensor may stand still
        (FROZEN, 60.0, 0.02, 1.0, False),  # and what was at rest does not count
        (GuardedChannel("load_cell.thrust", "N", 0.2, max_frozen=0.5), 0.6, 9.0, 5.0, True),
        (GuardedChannel("load_cell.thrust", "N", 0.2, max_frozen=inf), 99.0, 0.02, 99.0, False),
        (GuardedChannel("load_cell.thrust", "N", 0.2), 99.0, 0.02, 99.0, False),
    ],
)
def test_frozen_value(watch, same, longest, driven, trips):
    trip = check((watch,), {watch.channel: Latest(5.0, 10.0, same, longest)}, Vitals(10.0, 0.0, driven=driven), ALLOWED)
    assert (trip is not None) == trips
    assert trip is None or (trip.source, "without any change" in trip.cause) == ("frozen", True)


def test_thrust_is_watched_for_being_frozen_unless_switched_off():
    (thrust,) = guarded_channels([], (CELL,), ["load_cell.thrust"], "load_cell.thrust")
    assert thrust.max_frozen == 0.0
    (thrust,) = guarded_channels([LimitConfig("load_cell.thrust", max_frozen=inf)], (CELL,), (), "load_cell.thrust")
    assert thrust.max_frozen == inf
    assert guarded_channels([], (CELL,), ["load_cell.stable"], "load_cell.thrust")[0].max_frozen is None
