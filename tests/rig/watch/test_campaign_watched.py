"""A campaign in virtual time with its watcher: what an alarm leaves behind; a watcher's trouble ends nothing."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.protocols import Channel, Sample, Stream
from identification.physics.term import Scale
from identification.twin import TERMS, Twin, TwinNoise, TwinTerm, names_of
from rig.campaign.config import WatchConfig
from rig.campaign.dwell import FixedDwell
from rig.campaign.loading import load_campaign
from rig.campaign.plan import Plan
from rig.campaign.shapes import Levels
from rig.errors import ConfigError, LinkError
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Close, Failed, Rows
from rig.link.sockets import Peer, pair
from rig.link.watch_messages import Judged, Mismatch, Standing, Watched, WatchedStream
from rig.recording.ledger import read
from rig.stages.campaign import run
from rig.twin.writing import write_twin
from rig.watch.watch_link import WatchLink, run_of
from rig.watch.watcher import Watcher, settings_of
from tests.rig.virtual_bench import PLAN, VirtualBench, starter, virtual

LEVELS = (6.0, -6.0, 9.0, -9.0) * 6
WATCHED = Plan(Levels(LEVELS), FixedDwell(1.2, 0.2), slew=24.0, rest=0.3, tare=PLAN.tare, zero_every=4)
PROJECT = Path(__file__).parents[3]


@contextmanager
def watched(folder: Path, **campaign) -> Iterator[tuple[VirtualBench, WatchLink, Watcher]]:
    """A virtual bench whose watcher is the real one, on the other end of a real socket, stepped with the clock."""
    with virtual(folder, **({"plan": WATCHED} | campaign)) as world:
        ours, theirs = pair("watcher")
        link, watcher = WatchLink(ours, None), Watcher(Peer(theirs, "controller"))
        world.session.loop.watcher = link
        try:
            yield world, link, watcher
        finally:
            ours.close()
            watcher._peer.close()


def play(world: VirtualBench, watch: Callable[[], None]) -> list:
    """The whole campaign; `watch` is what the watcher does in each tick."""
    seen: list = []
    front = world.front()
    drive = starter(world, front, seen)

    def each(now: float) -> None:
        drive(now)
        watch()

    world.clock.each = each
    run(world.session)
    front.close()
    return seen


def fouled_from(world: VirtualBench, seconds: float, share: float = 0.06) -> None:
    """From then on the propeller gives less."""

    def foul() -> None:
        world.cell.spoil = lambda value: 0.7 + (value - 0.7) * (1 - share)

    world.clock.at.append((seconds, foul))


def test_alarm_is_on_the_screens_in_the_events_and_in_the_ledger_and_the_run_goes_on(tmp_path):
    with watched(tmp_path) as (world, _, watcher):
        fouled_from(world, 28.0)
        seen = play(world, watcher.step)
        assert world.session.status.outcome == "completed"
        events = [event for event in world.recorder.events if event.text.startswith("mismatch: thrust -")]
        assert events
        assert events[0].level == "warning"
        assert "while running, in both directions, since" in events[0].text
        facts = [fact for fact in read(tmp_path) if fact["fact"] == "mismatch"]
        assert facts[0]["place"] == "running"
        assert facts[0]["time"] < 27.0 + 15.0
        assert abs(facts[0]["began"] - 27.0) < 6.0, "t = 0 is a second after the clock's"
        assert -3.0 < facts[-1]["size_N"] < -0.5, "6 % of 32 N, seen a few holds after it began"
        said = [snapshot.watch.state for snapshot in seen]
        assert sorted(set(said), key=said.index) == ["off", "learning", "fits", "mismatch"]
        shown = seen[-1].watch
        assert shown.text.startswith("thrust -")
        assert (shown.low, shown.high) == (-9.0, 9.0)
        assert shown.sigma > 3.0
        assert abs(shown.began - 27.0) < 6.0
        after = [step.index for step in world.session.status.held if step.end > shown.began + 0.1 and step.voltage]
        assert shown.step == after[0]
        assert shown.advice.startswith(shown.brief)


def test_clean_campaign_of_two_thrusters_says_nothing_and_begins_anew_with_each(tmp_path):
    plan = replace(WATCHED, shape=Levels(LEVELS[:16]))
    with watched(tmp_path, thrusters=("T1", "T3"), plan=plan) as (world, _, watcher):

        def watch() -> None:
            if world.session.status.thruster == "T3":
                world.cell.spoil = lambda value: 0.8 * value  # another thruster, another tare
            watcher.step()

        seen = play(world, watch)
        assert world.session.status.outcome == "completed"
        assert {snapshot.watch.state for snapshot in seen if snapshot.state == "mount"} <= {"off", "learning"}
        assert len(world.recorder.of(Close)) == 2
        assert not [fact for fact in read(tmp_path) if fact["fact"] == "mismatch"]
        assert "not watched" not in world.texts


def test_alarm_of_a_run_that_is_over_is_in_the_ledger_and_troubles_no_other_run(tmp_path):
    plan = replace(WATCHED, shape=Levels(LEVELS[:4]))
    with watched(tmp_path, thrusters=("T1", "T3"), plan=plan, watch=WatchConfig(stop=True)) as (world, link, watcher):
        first: list[int | None] = []

        def watch() -> None:
            watcher.step()
            first.append(link.t0_ns)
            if world.session.status.thruster == "T3" and link.t0_ns is not None and not told:
                told.append(next(t0 for t0 in first if t0 is not None))
                late = Mismatch(told[0], "T1", 9.0, 4.0, "zero", "zero +1 N", "zero +1 N at rest", 1.0, 100.0)
                watcher._peer.send(late)
                watcher._peer.send(Judged(told[0], 9, True, Standing("zero", "", "", 4.0, False, 9.0, "", "")))

        told: list[int] = []
        seen = play(world, watch)
        assert told
        assert world.session.status.outcome == "completed", "watch.stop stops the run that it is said of"
        assert "mismatch" not in world.texts
        assert not any(snapshot.watch.state == "mismatch" for snapshot in seen)
        facts = [fact for fact in read(tmp_path) if fact["fact"] == "mismatch"]
        assert [(fact["thruster"], fact["late"]) for fact in facts] == [("T1", True)]


def test_alarm_ends_the_campaign_where_that_is_asked_for(tmp_path):
    with watched(tmp_path, watch=WatchConfig(stop=True)) as (world, _, watcher):
        fouled_from(world, 28.0)
        play(world, watcher.step)
        assert world.session.status.outcome == "aborted"
        assert "stopped by the watch (watch.stop = true): thrust -" in world.session.status.cause
        assert world.motor.volts == 0.0
        assert world.recorder.of(Close)[0].outcome == "aborted"


def test_watcher_that_dies_is_said_once_and_the_run_goes_on(tmp_path):
    with watched(tmp_path, plan=PLAN) as (world, link, watcher):
        watcher._peer.close()
        play(world, lambda: None)
        assert world.session.status.outcome == "completed"
        assert world.texts.count("this run is not watched for mismatches") == 1
        assert "ended" in link.failed


def test_watcher_that_reads_nothing_holds_nothing(tmp_path):
    ours, theirs = pair("watcher", 5000)
    link = WatchLink(ours, None)
    link.begin(Watched("T1", 0, (WatchedStream("cell", ((0, "thrust"),)),), 9.0, 0.05))
    rows = [Sample("cell", k, (1.0,)) for k in range(40_000)]
    link.rows(rows, 1.0)
    link.rows(rows, 2.0)
    assert "does not read" in link.failed
    assert link.heard() == []
    ours.close()
    theirs.close()


def test_orders_that_are_none_are_refused_by_both_sides():
    ours, theirs = pair("watcher")
    watcher, link = Watcher(Peer(theirs, "controller")), WatchLink(ours, None)
    ours.send(Rows(0, np.array([1]), np.array([[1.0]])))
    watcher.step()
    ours.send(Request("stop"))
    with pytest.raises(LinkError, match="which a watcher does not take"):
        watcher.step()
    watcher._peer.send(Failed("the catalogue is gone"))
    assert link.heard() == []
    assert link.failed == "the catalogue is gone"
    ours.close()
    watcher._peer.close()


def test_every_stream_is_fed_once_and_the_modelled_thrust_alone():
    thrust, second = Channel("thrust", "thrust", "N"), Channel("spare", "thrust", "N")
    streams = {
        "spare": Stream("spare", "virtual", (second,), 0.01),
        "cell": Stream("cell", "virtual", (Channel("stable", None, "1"), thrust), 0.01),
        "supply": Stream("supply", "virtual", (Channel("u", "bus_voltage", "V"),), 0.1),
        "supply2": Stream("supply2", "virtual", (Channel("u", "bus_voltage", "V"),), 0.1),
    }
    with virtual_campaign(twin="twins/{thruster}.json") as campaign:
        made = run_of(campaign, streams, "cell.thrust", "T3", 7)
    assert [(s.name, s.columns) for s in made.streams] == [
        ("cell", ((1, "thrust"),)),
        ("supply", ((0, "bus_voltage"),)),
        ("command", ((0, "command_voltage"),)),
    ]
    assert made.twin == "twins/T3.json"
    assert made.highest == 6.0


@contextmanager
def virtual_campaign(**watch) -> Iterator:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder, virtual(Path(folder), watch=WatchConfig(**watch)) as world:
        yield world.session.campaign


def twin(*terms: TwinTerm) -> Twin:
    names = names_of(terms)
    zeros = tuple(tuple(1e-6 * (i == j) for j in range(len(names))) for i in range(len(names)))
    return Twin("T1", "command_voltage", 0.4, terms, names, zeros, TwinNoise(0.01, 0.0), (), 0.02, 10.0, 1.1)


def test_twin_is_read_by_the_watcher_or_the_run_is_not_watched(tmp_path):
    path = tmp_path / "T1.json"
    write_twin(twin(), path)
    order = Watched("T1", 0, (), 10.0, 0.05, str(path))
    settings = settings_of(order)
    assert settings.expected is not None
    assert settings.expected(5.0, 48.0, 0.0, 0.0) == pytest.approx(10.0)
    ours, theirs = pair("watcher")
    watcher, link = Watcher(Peer(theirs, "controller")), WatchLink(ours, None)
    link.begin(replace(order, thruster="T3"))
    watcher.step()
    assert link.heard() == []
    assert "is the twin of T1, but T3 is on the bench" in link.failed
    scale = Scale(10.0, "V", 40.0, 100.0, 0.02)
    term = TERMS["rotation_coupling", ""]
    middle = {p.name: p.low + 0.1 * (min(p.high, 1e3) - p.low) for p in term.parameters(scale)}
    write_twin(twin(TwinTerm(term.id, term.form, middle, scale)), path)
    link.begin(order)
    watcher.step()
    link.heard()
    assert "does not feed" in link.failed
    ours.close()
    watcher._peer.close()


def test_process_watches_and_ends_with_its_link(tmp_path):
    with (tmp_path / "watcher.log").open("ab") as log:
        link = WatchLink.start(log)
    link.begin(Watched("T1", 0, (WatchedStream("command", ((0, "command_voltage"),)),), 9.0, 0.05))
    link.rows([Sample("command", 0, (0.0,))], 1.0)
    assert link.failed == ""
    link.peer.close()
    assert link.process is not None
    assert link.process.wait(60) == 0
    link.shut_down()
    assert (tmp_path / "watcher.log").read_text() == ""


def test_mismatch_crosses_the_link_whole():
    ours, theirs = pair("watcher")
    other = Peer(theirs, "controller")
    said = Mismatch(7, "T1", 9.0, 4.0, "zero", "zero +1 N", "zero +1 N at rest", 1.0, 100.0)
    other.send(said)
    assert WatchLink(ours, None).heard() == [said]
    ours.close()
    other.close()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("false_alarms_per_hour = 0.0", "watch.false_alarms_per_hour must be above 0"),
        ("false_alarm_per_hour = 0.1", "did you mean watch.false_alarms_per_hour"),
        ('twin = "twins/{thruster}.json"', "watch.twin of T1 is"),
        ("stop = 1", "watch.stop must be true or false"),
    ],
)
def test_settings_that_are_wrong_are_refused(tmp_path, text, complaint):
    with pytest.raises(ConfigError, match=complaint):
        load_campaign(campaign_file(tmp_path, text))


def test_settings_of_the_campaign_file(tmp_path):
    assert load_campaign(campaign_file(tmp_path, "")).watch == WatchConfig()
    write_twin(twin(), tmp_path / "T1.json")
    found = load_campaign(campaign_file(tmp_path, 'twin = "{thruster}.json"\nstop = true\nfalse_alarms_per_hour = 1.0'))
    assert found.watch == WatchConfig(1.0, str(tmp_path / "{thruster}.json"), off=False, stop=True)


def campaign_file(folder: Path, text: str) -> Path:
    demo = (PROJECT / "campaigns/demo.toml").read_text()
    bench = json.dumps(str(PROJECT / "benches/simulated/bench.toml"))
    demo = demo.replace('"../benches/simulated/bench.toml"', bench).replace('["T1", "T3"]', '["T1"]')
    path = folder / "campaign.toml"
    path.write_text(demo + "\n[watch]\n" + text + "\n")
    return path
