"""Promises 29 and 30: who looks on, and how often he dies, is in no step, event or sample of a recording. Virtual."""

import os

import pytest

from rig.link.front_end_messages import Request
from rig.link.recorder_messages import EventRow
from rig.link.sockets import encode
from rig.operate.headless import Headless
from rig.stages.campaign import run
from tests.rig.stages.played import outcome
from tests.rig.virtual_bench import virtual

DEATHS = 20
START = 3.0
"""s, of the bench, when somebody looks at it."""
EVERY = 0.15
"""s between two deaths; the run takes 5 s."""


def kept(world):
    """All that the recorder was given: steps, rows as bytes, and events but those of who came and went."""
    rows = [(each.stream, each.t_ns.tobytes(), each.values.tobytes()) for each in world.recorder.rows]
    events = [(e.time, e.level, e.text) for e in world.recorder.of(EventRow) if "front end" not in e.text]
    return world.recorder.steps, rows, events


def passed(snapshot):
    return snapshot.state == "preflight" and all(check.verdict in ("passed", "warning") for check in snapshot.checks)


class Attending:
    """A front end that reads every snapshot from `START` on, says that it is there, and starts once: a console at which
    somebody presses F5 when the checks have passed."""

    def __init__(self, world, leases=True):
        self.world, self.peer, self.leases, self.asked, self.seen = world, world.front(), leases, False, 0

    def __call__(self, now):
        for snapshot in self.peer.receive():
            self.seen += 1
            if now >= START and passed(snapshot) and not self.asked:
                self.asked = True
                self.peer.send(Request("start"))
            if snapshot.state == "mount":
                self.peer.send(Request("mounted"))
        if self.leases:
            self.peer.send(Request("lease"))


class Unattended(Headless):
    """`rig run --headless` asked once a tick, in the place of its own loop around a socket."""

    def __call__(self, now):
        for message in self.peer.receive():
            self.last = message if now >= START else None
        if self.last is not None:
            self._answer(self.last, start=True)
        self._send(Request("lease"))


def ran(world, front):
    world.clock.each = front
    try:
        run(world.session)
    finally:
        front.peer.close()
    assert outcome(world) == ("completed", "")
    return kept(world), world.motor.sent, world.session.status.points


@pytest.fixture
def by_console(tmp_path):
    (tmp_path / "console").mkdir()
    (tmp_path / "other").mkdir()
    with virtual(tmp_path / "console", unattended=False, mount=()) as world:
        front = Attending(world)
        found = ran(world, front)
        assert front.seen > 20
        return found


def test_headless_equals_console(tmp_path, by_console):
    """The same plan and the same noise: the same steps, events, samples and commands, to the bit."""
    with virtual(tmp_path / "other", unattended=False, mount=()) as world:
        assert ran(world, Unattended(world.front())) == by_console
    (steps, rows, events), sent, points = by_console
    assert (len(steps) > 5, len(rows) > 50, len(events) > 3, len(sent) > 100, len(points)) == (
        True,
        True,
        True,
        True,
        2,
    )


class Dying(Attending):
    """Closes without a word once the run is on, and another comes, `DEATHS` times; each third leaves half a message."""

    deaths = 0
    last = START

    def __call__(self, now):
        super().__call__(now)
        if self.world.session.loop.recording_since_ns is None or self.deaths == DEATHS or now < self.last + EVERY:
            return
        self.deaths, self.last = self.deaths + 1, now
        if self.deaths % 3 == 0:
            os.write(self.peer.fileno(), encode(Request("note", "never ended"))[:-4])
        self.peer.close()
        self.peer = self.world.front()


def test_front_ends_that_are_killed_and_come_again_change_nothing(tmp_path, by_console, report):
    with virtual(tmp_path / "other", mount=()) as world:
        front = Dying(world, leases=False)
        assert ran(world, front) == by_console
    assert front.deaths == DEATHS
    report("front ends killed, nothing of the recording changed", DEATHS, "")
