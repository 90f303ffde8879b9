"""All that crosses between controller, recorder and front ends. Frozen; JSON on the wire (see `rig.link.sockets`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

State = Literal[
    "connecting",  # opening ports, identifying
    "preflight",  # checks shown, waiting for the operator's start
    "mount",  # waiting until the named thruster is on the bench
    "proving",  # the motor's own watchdog is being proved
    "tare",
    "ramp",
    "hold",
    "rest",
    "wait",  # zero volts, the water settles or the motor cools down
    "sine",
    "free",
    "paused",  # zero volts, waiting for resume
    "stopping",  # command 0, waiting for measured rotation to end
    "run_done",  # a recording was closed; next thruster follows
    "done",  # the campaign has ended, however it ended: see outcome
]


@dataclass(frozen=True, slots=True)
class Check:
    """One line of the preflight list."""

    name: str
    verdict: Literal["waiting", "passed", "warning", "failed"]
    text: str


@dataclass(frozen=True, slots=True)
class Reading:
    """Latest value of one channel, with what the guard thinks of it."""

    channel: str
    """`<stream>.<channel>`, e.g. `load_cell.thrust`."""
    quantity: str
    unit: str
    value: float | None
    """None: nothing came yet, or the device gave NaN."""
    age: float | None
    """s since the row arrived; None: none came yet."""
    low: float | None = None
    high: float | None = None
    max_age: float | None = None
    state: Literal["ok", "stale", "limit", "none"] = "ok"


@dataclass(frozen=True, slots=True)
class StreamHealth:
    """How one stream of a device comes."""

    name: str
    nominal: float
    """rows per s, by the bench file."""
    rate: float | None
    """rows per s over the last rows; None: fewer than three came."""
    age: float | None
    """s since its newest row; None: none came."""


@dataclass(frozen=True, slots=True)
class Device:
    """One device of the bench: who it says it is, and how well it is heard."""

    name: str
    kind: str
    port: str
    identity: str
    """Model and serial number as it said them; empty: it is not open."""
    fault: str
    """Why its link is not alive; empty: it is, or the device is not open."""
    streams: tuple[StreamHealth, ...]
    received: int = 0
    """Frames or lines since it was opened; of a bus: those of everybody on it."""
    bad: int = 0
    """Of them not understood."""
    first_bad: str = ""
    dropped: int = 0
    """Lost because the loop did not take them in time."""
    calibrated: str = ""
    """ISO date of its calibration; empty: the bench file has none."""
    valid_until: str = ""
    """ISO date up to which that is good; empty: the bench file does not say."""
    days_left: int | None = None
    """Days to `valid_until`, negative: it is over; None: not known."""
    certificate: str = ""
    watchdog: str = ""
    """Of the motor controller: its own command timeout, as it or the bench file says it."""
    watchdog_measured: float | None = None
    """s from the last command to measured rest, in the newest proof; None: none was made yet."""


@dataclass(frozen=True, slots=True)
class TracedChannel:
    """One recorded channel, by the names of the recording."""

    channel: str
    """`<stream>.<channel>`; `command` is what was sent to the motor."""
    quantity: str
    unit: str


TraceRow = tuple[float, ...]
"""(s of the recording, then least and greatest of each channel in the tenth of a second around it); NaN: no sample."""


@dataclass(frozen=True, slots=True)
class Point:
    """A finished hold: the mean thrust, tare subtracted, and its standard error honest under autocorrelation."""

    step: int
    voltage: float
    """V commanded."""
    thrust: float
    """N, latest tare subtracted."""
    std_error: float
    """N."""
    duration: float
    steady: bool
    """Verdict of the dwell: False = drift or standard error still above the threshold at the maximum dwell."""
    thruster: str = ""
    dof: float = math.inf
    """Degrees of freedom behind `std_error`."""


@dataclass(frozen=True, slots=True)
class LogLine:
    """One line of the log that a front end shows."""

    time: float
    """s since the controller began; in the recording's own events since its t0."""
    level: Literal["info", "warning", "trip", "error"]
    text: str
    run: int = 0
    """0-based index of the run that it is of; -1 before the campaign was started."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is, and how much of it is left; times in s."""

    step: int
    """0-based index of the running step in its plan."""
    steps: int
    step_elapsed: float
    step_expected: float
    """s; for a hold until steady the expectation, at most its maximum."""
    run: int
    """0-based index of the running thruster."""
    runs: int
    elapsed: float
    """s since the campaign's start key."""
    eta: float
    """s to the end of the campaign, by plan."""
    fraction: float
    """0..1 of the campaign."""


@dataclass(frozen=True, slots=True)
class Watching:
    """What the watch says of this run by now (docs/howto/watch.md)."""

    state: Literal["off", "learning", "fits", "mismatch", "failed"] = "off"
    text: str = ""
    """What is off and by how much; of `failed`: why the run is not watched."""
    step: int | None = None
    """0-based index of the first step that does not fit; None: not known."""
    low: float | None = None
    """V, lowest and highest level from then on at which it shows; None: none was held since."""
    high: float | None = None
    began: float = 0.0
    """s of the recording."""
    from_start: bool = False
    sigma: float = 0.0
    """Size in its standard deviations."""
    brief: str = ""
    """What to do first, in a few words."""
    advice: str = ""
    """What to do."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The whole state a front end shows, 10 times a second. Lists that only grow (`points`, `log`) are sent whole,
    so that a console attached late knows everything; `trace` is what came since the last snapshot of this client."""

    seq: int
    campaign: str
    state: State
    thruster: str
    command: float
    """V, as sent in this tick."""
    time: float
    """s since the start of the recording (0 outside one)."""
    readings: tuple[Reading, ...]
    checks: tuple[Check, ...]
    points: tuple[Point, ...]
    """Of this thruster's run."""
    log: tuple[LogLine, ...]
    """Newest 500 events of the campaign."""
    log_count: int
    """Events so far, including those that are no longer in `log`."""
    trace: tuple[TraceRow, ...]
    """10 rows/s; what a console attached late has missed of this run's last two minutes comes first, bit by bit."""
    progress: Progress | None
    files: tuple[str, ...]
    """Recordings of this campaign so far, the running one last."""
    outcome: Literal["", "running", "completed", "aborted", "tripped"] = ""
    cause: str = ""
    """Why it stopped, one sentence; empty while running or completed."""
    stop_confirmed: bool | None = None
    """After a stop: True = measured rest, False = STOP NOT CONFIRMED, None = not stopped or still waiting."""
    attended: bool = True
    """False: the campaign may go on with no front end connected (`unattended = true`)."""
    clients: int = 0
    """Front ends that attend; those that only look on are not among them."""
    since_begin: float = 0.0
    """s since the controller began, the clock of `log`."""
    mounted_by_hand: bool = False
    """True: in the state `mount` an operator puts the thruster on the bench, then sends `mounted`. False: a command."""
    reason: str = ""
    """In the states `wait` and `paused`: what for, and with what is left, in one sentence."""
    state_elapsed: float = 0.0
    """s in this wait or pause so far."""
    watch: Watching = Watching()
    devices: tuple[Device, ...] = ()
    """In the order of the bench file."""
    channels: tuple[TracedChannel, ...] = ()
    """Of `trace`, in the order of its numbers."""
    replay: bool = False
    """A recording plays: there is no controller, and what is asked moves nothing."""


RequestKind = Literal[
    "start",  # begin the first run (preflight passed)
    "retry",  # try once more to open the device of that name (preflight); "": all that are not there
    "mounted",  # the thruster asked for is on the bench
    "stop",  # zero now, end the campaign, close the file
    "pause",
    "resume",
    "accept",  # end the running hold now, keep its data
    "skip",  # leave the running step out: nothing of it counts
    "repeat",  # take the running step again from its beginning
    "back",  # measure the step before once more, and go on from there
    "extend",  # let the running hold last longer
    "bad",  # what was measured last is wrong: no fit takes it
    "note",  # operator's remark into the events
    "detach",  # this client leaves on purpose; refused (log line) when attended and no other client is there
    "lease",  # I am here (sent twice a second by a front end that attends)
    "watch",  # I look on and do not attend (as often, in its place): of what I ask, only a stop is obeyed
]


@dataclass(frozen=True, slots=True)
class Request:
    """What a front end asks of the controller, which decides."""

    kind: RequestKind
    text: str = ""
    """The note, or who asks for the stop (`console`, `headless`, `SIGTERM` ...)."""
