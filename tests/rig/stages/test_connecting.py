"""The preflight lives: rows turn red when a link dies and green when it is back; nothing turns meanwhile."""

import pytest

from rig.link.front_end_messages import Request
from rig.stages.campaign import run
from tests.rig.stages.played import outcome
from tests.rig.virtual_bench import virtual

pytestmark = pytest.mark.timeout(60)


def row(world, name):
    return next(check for check in world.session.status.checks if check.name == name)


def watched(world, script, end=60.0):
    """Run the campaign with a front end that asks for a start twice a second; `script`: (s, what to do then)."""
    front, todo = world.front(), list(script)
    began = world.clock.t_ns * 1e-9

    def each(now):
        front.receive()
        if round(now * 50) % 25 == 0:
            front.send(Request("start"))
        while todo and now - began >= todo[0][0]:
            todo.pop(0)[1]()
        if now - began > end:
            world.session.loop.signals.append(Request("stop", "a test"))

    world.clock.each = each
    run(world.session)
    world.recorder.step(1e9)
    front.close()
    assert not todo


def test_device_that_does_not_open_is_tried_again_until_it_does(tmp_path):
    with virtual(tmp_path) as world:
        world.cell.refuses = "load_cell: no cable"
        seen = []

        def look():
            seen.append((row(world, "load_cell").verdict, row(world, "motor").verdict))

        watched(world, [(2.0, look), (5.0, lambda: setattr(world.cell, "refuses", "")), (9.0, look)])
        assert seen[0] == ("failed", "passed")
        assert outcome(world) == ("completed", "")
        assert world.texts.count("load_cell: no cable") == 1 + world.texts.count("not started: load_cell: no")
        assert "load_cell is back: virtual cell 2" in world.texts
        assert len(list(tmp_path.glob("controller.log"))) == 1, "in the same folder"


@pytest.mark.parametrize(
    ("dies", "back", "said"),
    [
        (
            lambda w: setattr(w.cell, "error", "it was pulled"),
            lambda w: setattr(w.cell, "error", None),
            "it was pulled",
        ),
        (
            lambda w: setattr(w.cell, "spoil", lambda value: None),
            lambda w: setattr(w.cell, "spoil", lambda value: value),
            "nothing came from load_cell for 2.0 s",
        ),
        (lambda w: setattr(w.motor, "refuses", True), lambda w: setattr(w.motor, "refuses", False), "takes nothing"),
        (
            lambda w: setattr(w.motor, "silent", True),
            lambda w: setattr(w.motor, "silent", False),
            "nothing came from m",
        ),
    ],
    ids=["cell pulled", "cell silent", "motor pulled", "motor silent"],
)
def test_link_that_dies_turns_red_and_is_opened_again(tmp_path, dies, back, said):
    with virtual(tmp_path, mount=()) as world:
        red, begun = [], []

        def look():
            red.extend(check.text for check in world.session.status.checks if check.verdict == "failed")
            begun.append(world.session.status.started)

        world.motor.timeout = 3.0  # longer than the limit of the bench: nothing starts meanwhile
        able = (12.0, lambda: setattr(world.motor, "timeout", 0.5))
        watched(
            world,
            [(1.0, lambda: dies(world)), (4.5, look), (5.0, lambda: back(world)), able],
            end=16.0,
        )
        assert any(said in text for text in red), red
        assert begun == [None]
        assert " is back: virtual " in world.texts
        assert world.session.status.started is not None, "then it can be started"
        assert not [volts for _, volts in world.motor.sent if volts]


def test_one_key_tries_one_device_at_once(tmp_path):
    with virtual(tmp_path) as world:
        world.cell.refuses = "load_cell: no cable"
        verdicts = []

        def ask(name):
            world.session.loop.signals.append(Request("retry", name))

        def look():
            verdicts.append(row(world, "load_cell").verdict)

        mend = (0.5, lambda: setattr(world.cell, "refuses", ""))
        asks = [(0.6, lambda: ask("motor")), (0.7, look), (0.8, lambda: ask("load_cell")), (0.9, look)]
        watched(world, [mend, *asks])
        assert verdicts == ["failed", "passed"], "before it would have been tried by itself"
        assert outcome(world) == ("completed", "")


def test_another_device_in_its_place_is_red_until_the_right_one_is_back(tmp_path):
    """Promise 23, of a campaign that is resumed."""
    before = ({"fact": "start", "identities": {"motor": "virtual motor 9"}},)
    with virtual(tmp_path, before=before) as world:
        told = []
        watched(world, [(5.0, lambda: told.append(row(world, "motor")))], end=6.0)
        assert told[0].verdict == "failed"
        assert "motor is virtual motor 1, but the campaign was begun with virtual motor 9" in told[0].text
        assert outcome(world) == ("aborted", "stopped by a test")
        assert not world.motor.sent or {volts for _, volts in world.motor.sent} == {0.0}
