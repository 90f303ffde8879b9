"""What is on the pictures: a feed played up to a moment, the keys pressed then, and how long nothing came after."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace

from textual.pilot import Pilot

from rig.console.app import ConsoleApp
from rig.console.view_model.answers import Answer, answer_of, fault_of
from rig.link.front_end_messages import LogLine, Point, Progress, Snapshot, Watching
from tests.rig.console.feeds import CHECKS, DEVICES, LOG, ManualClock, PlayedFeed, campaign, running, snapshot
from tests.rig.console.past import TELLS_PAST
from tests.rig.console.told import EXPLAINED, ambiguous, message, unexplained


@dataclass(frozen=True)
class Scene:
    snapshots: tuple[Snapshot, ...]
    keys: tuple[str, ...] = ()
    gone: bool = False
    answers: tuple[Answer, ...] = ()
    """Of diagnoses that have ended."""
    doing: str = ""
    """What a diagnosis that goes on says."""
    silence: float = 0.0
    """s between the last snapshot and the picture."""


NO_ANSWER = "no answer on ports/flow within 2.0 s; is it powered?"
FAILED = tuple(replace(c, verdict="failed", text=NO_ANSWER) if c.name == "flow" else c for c in CHECKS)
REFUSAL = LogLine(9.4, "warning", f"not started: flow: {NO_ANSWER}", -1)
STALE = tuple(
    replace(r, state="stale", age=1.9) if r.channel == "flow.flow_speed"
    else replace(r, state="limit", value=41.2) if r.channel == "motor.current" else r
    for r in running().readings
)  # fmt: skip

TROUBLED = (
    replace(DEVICES[0], fault="its port is gone: /dev/ttyUSB0 was unplugged"),
    replace(DEVICES[1], watchdog_measured=None, streams=tuple(replace(s, rate=31.0) for s in DEVICES[1].streams)),
    replace(DEVICES[2], identity="", received=0, bad=0, first_bad=""),
    replace(DEVICES[3], streams=(replace(DEVICES[3].streams[0], age=4.2),)),
)

HEADLINE = "thrust -2.6 % (-4.3 N) while running, in both directions, since 32 s"
MISMATCH = LogLine(
    46.2,
    "warning",
    f"mismatch: {HEADLINE} (between 30 and 36 s), ± 0.3 N; e-value 4.8e+04; look at the propeller and at what drives "
    "it; the zero at rest has not moved with it",
)

PAST_END = replace(campaign()[-1], files=("recordings/autumn-2/T1.h5", "recordings/autumn-2/T2.h5"))
ANSWERS = (
    answer_of(("recordings/2026-11-21_1502_T1.h5",), message(EXPLAINED)),
    answer_of(("recordings/2026-11-21_1506_T3.h5",), message(ambiguous("T3"))),
    answer_of(("recordings/2026-11-21_1511_T2.h5",), message(unexplained("T2"))),
)
DEVIATES = Watching(
    "mismatch", "thrust -2.6 % (-4.3 N)", step=11, low=-20.0, high=20.0, began=32.0, sigma=14.3,
    brief="look at the propeller",
    advice="look at the propeller and at what drives it; the zero at rest has not moved with it",
)  # fmt: skip


def bent(points: tuple[Point, ...]) -> tuple[Point, ...]:
    """Weaker in reverse than `C V|V|` has it."""
    return tuple(replace(p, thrust=0.92 * p.thrust if p.voltage < 0 else p.thrust) for p in points)


BENT = bent(running().points)

SCENES = {
    "preflight": Scene((snapshot("preflight"),)),
    "preflight_failed": Scene((snapshot("preflight", checks=FAILED, log=(REFUSAL,), log_count=1),)),
    "sweep": Scene((running(),)),
    "fit": Scene((running(),), keys=("2",)),
    "time": Scene((running(),), keys=("3",)),
    "events": Scene((running(),), keys=("4",)),
    "limit": Scene((running(readings=STALE),)),
    "mismatch": Scene((running(log=(*LOG, MISMATCH), log_count=len(LOG) + 1, watch=DEVIATES),)),
    "mismatch_fit": Scene((running(watch=DEVIATES),), keys=("2",)),
    "mismatch_time": Scene((running(watch=DEVIATES),), keys=("3",)),
    "misfit": Scene((running(points=BENT, watch=Watching("fits")),), keys=("2",)),
    "mount": Scene((
        running("mount", thruster="T3", command=0.0, points=(), trace=(), mounted_by_hand=True,
                progress=Progress(0, 0, 0.0, 0.0, 1, 2, 60.0, 241.0, 0.2), log_count=len(LOG) + 1,
                log=(*LOG, LogLine(60.0, "info", "put T3 on the bench", 1))),)),
    "bench": Scene((running(),), keys=("7",)),
    "bench_trouble": Scene((snapshot("preflight", checks=FAILED, devices=TROUBLED),), keys=("7",)),
    "warnings": Scene((running(),), keys=("4", "f")),
    "wait": Scene((running("wait", command=0.0, state_elapsed=17.0, reason="water settles: 43 s left; motor "
                           "temperature 61.2 °C, goes on below 50 °C, at most 9 min more"),)),
    "paused": Scene((running("paused", command=0.0, state_elapsed=83.0, reason="by the operator"),)),
    "keys": Scene((running(),), keys=("question_mark",)),
    "channels": Scene((running(),), keys=("c", *"mot")),
    "current": Scene((running(),), keys=("3", "c", *"current", "enter")),
    "palette": Scene((running(),), keys=("colon",)),
    "palette_not_now": Scene((snapshot("preflight", checks=FAILED),), keys=("colon", *"st")),
    "looks_on": Scene((running(attended=True, clients=2),)),
    "note": Scene((running(),), keys=("n", *"weed on duct")),
    "leave": Scene((running(),), keys=("d",)),
    "leave_attended": Scene((running(attended=True),), keys=("d",)),
    "disconnected": Scene((running(),), gone=True, silence=14.3),
    "stop_not_confirmed": Scene((running("stopping", command=0.0, stop_confirmed=False),)),
    "diagnosis": Scene(campaign(), keys=("6",), answers=ANSWERS[1:2],
                       doing="diagnosing T2.h5: 12 s, looking for effects: dead band   (Escape ends it)"),
    "diagnoses": Scene(campaign(), keys=("6",), answers=(fault_of(("T9.h5",), "T9.h5: no such file"), *ANSWERS)),
    "next_sweep": Scene(campaign(), keys=("6", "s"), answers=ANSWERS),
    "history": Scene((PAST_END,), keys=("8", "down", "down", "space", "down", "down")),
    "compare": Scene((PAST_END,), keys=("8", "down", "down", "space", "end", "enter")),
    "end": Scene(campaign()),
    "end_misfit": Scene((*campaign()[:2], *(replace(s, points=bent(s.points)) for s in campaign()[3:]))),
    "tripped": Scene((running("done", outcome="tripped", stop_confirmed=True, command=0.0,
                              cause="motor.current 41.2 A is above its limit of 40 A."),)),
}  # fmt: skip


def prepare(scene: Scene, colors: str = "full") -> tuple[ConsoleApp, Callable[[Pilot[None]], Awaitable[None]]]:
    """The application, and what has to be awaited until it shows the scene."""
    feed, clock = PlayedFeed(*scene.snapshots), ManualClock()
    app = ConsoleApp(feed, clock, "rig console recordings/2026-11-21_1502", colors=colors)

    async def play(pilot: Pilot[None]) -> None:
        await settle(pilot, lambda: app.state.snapshot is scene.snapshots[-1])
        app.answers, app.begins = scene.answers, True
        app.tell_of(scene.doing)
        app.catalogue = TELLS_PAST
        for key in scene.keys:
            await pilot.press(key)
            await settle(pilot, lambda: not app.looks_back)
        if scene.gone:
            feed.end()
            await settle(pilot, lambda: not app.state.connected)
        clock.now += scene.silence
        await show(pilot, app)

    return app, play


async def settle(pilot: Pilot[None], reached: Callable[[], bool]) -> None:
    """Let the application's messages run until `reached`; the test's own timeout ends it otherwise."""
    while not reached():
        await pilot.pause(0.01)


async def show(pilot: Pilot[None], app: ConsoleApp) -> None:
    """Draw now instead of at the next tick: pages first, and again when they have their sizes."""
    for _ in range(3):
        app.show_text()
        app.show_plots()
        await pilot.pause()
    await pilot.wait_for_scheduled_animations()
    await pilot.pause()
