"""What rings, and that it rings at most once each."""

from rig.link.attention import PATIENCE, Bell, wanted_for
from tests.rig.console.feeds import CHECKS, running, snapshot
from tests.rig.console.scenes import FAILED


def test_what_somebody_must_come_for():
    assert wanted_for(snapshot("preflight", checks=CHECKS)) == "ready"
    assert wanted_for(snapshot("preflight", checks=FAILED)) == ""
    assert wanted_for(snapshot("preflight", checks=())) == ""
    assert wanted_for(running("mount", thruster="T3", mounted_by_hand=True)) == "mount T3"
    assert wanted_for(running("mount")) == ""
    assert wanted_for(running("stopping", outcome="tripped")) == "tripped"
    assert wanted_for(running("stopping", outcome="aborted")) == ""
    assert wanted_for(running("paused")) == "paused"
    assert wanted_for(running("wait")) == ""
    assert wanted_for(running("done")) == "done"


def rung(*wanted: tuple[float, str]) -> list[str]:
    bell = Bell()
    return [what for now, what in wanted if bell.rings(what, now)]


def test_each_rings_once_however_often_it_is_seen():
    assert rung((0, "ready"), (1, "ready"), (2, ""), (3, "ready")) == ["ready"]
    assert rung((0, "mount T1"), (9, ""), (10, "mount T2"), (11, ""), (12, "done")) == ["mount T1", "mount T2", "done"]


def test_every_pause_rings_once():
    assert rung((0, "paused"), (1, "paused"), (2, ""), (3, "paused")) == ["paused", "paused"]


def test_a_link_that_comes_and_goes_does_not_ring_all_the_time():
    assert rung((0, "danger"), (1, ""), (2, "danger"), (3, ""), (PATIENCE, "danger")) == ["danger", "danger"]
