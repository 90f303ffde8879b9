"""A campaign on the virtual bench, played from a front end; what came of it."""

from collections.abc import Callable

from rig.link.front_end_messages import Snapshot
from rig.stages.campaign import run
from tests.rig.virtual_bench import VirtualBench, starter


def play(world: VirtualBench, at=(), each=None) -> list[Snapshot]:
    """Run the campaign with a front end that starts it. `at`: (state, volts, what to do there once)."""
    seen: list[Snapshot] = []
    front = world.front()
    drive = starter(world, front, seen)
    todo = list(at)

    def tick(now: float) -> None:
        drive(now)
        if each is not None:
            each(now)
        status, command = world.session.status, world.session.loop.command
        for item in list(todo):
            state, volts, what = item
            if status.state == state and abs(command - volts) < 1e-9:
                todo.remove(item)
                what()

    world.clock.each = tick
    try:
        run(world.session)
    finally:
        world.recorder.deaf = False
        world.recorder.step(1e9)
        front.close()
    assert not todo, "what was to happen never did"
    assert world.motor.volts == 0.0 or world.motor.ignores or world.motor.refuses
    assert world.motor.closed, "the ports are closed, however it ended"
    return seen


def outcome(world: VirtualBench) -> tuple[str, str]:
    return world.session.status.outcome, world.session.status.cause


def left_alone(world: VirtualBench, reached: Callable[[], bool]) -> float:
    """Run a campaign whose only front end starts it and is gone in the tick in which it is `reached`; when, in s."""
    front, left = world.front(), list[float]()
    drive = starter(world, front, [])

    def tick(now: float) -> None:
        if left:
            return
        drive(now)
        if reached():
            left.append(now)
            front.close()

    world.clock.each = tick
    run(world.session)
    return left[0]
