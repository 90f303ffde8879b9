"""Bench and campaign as frozen dataclasses. `loading` turns TOML into these or raises ConfigError."""

from __future__ import annotations

import datetime
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig.campaign.calibration_file import CalibratedCell
from rig.campaign.plan import Plan, TareConfig


@dataclass(frozen=True, slots=True)
class CanBusConfig:
    """`[can.<name>]`"""

    interface: str = "slcan"
    channel: str = ""
    """Port; a relative path with a slash is relative to the bench file."""
    bitrate: int = 500_000
    capture: str = ""
    """File that every frame is written to, with its time."""

    def __post_init__(self) -> None:
        if not self.channel:
            raise ValueError("channel is missing: the adapter's port, or the network's name (can0)")
        if self.bitrate <= 0:
            raise ValueError(f"bitrate must be above 0 bit/s, but is {self.bitrate}")


@dataclass(frozen=True, slots=True)
class DeviceConfig:
    """`[devices.<name>]`: `kind` is a key of drivers.KINDS, `options` an instance of that kind's own dataclass."""

    name: str
    kind: str
    options: Any


@dataclass(frozen=True, slots=True)
class CalibrationConfig:
    """`[calibration.<device>]`: from when its calibration is, and how long it is good."""

    date: datetime.date
    valid_until: datetime.date | None = None
    """The last day."""
    certificate: str = ""
    """Number, or where it is."""
    file: str = ""
    """Path of what `rig calibrate` wrote, relative to the bench file: its curve corrects what the device reads."""

    def __post_init__(self) -> None:
        if self.valid_until is not None and self.valid_until < self.date:
            raise ValueError(f"valid_until ({self.valid_until}) is before date ({self.date})")

    def days_left(self, today: datetime.date) -> int | None:
        """Days until it is over, negative when it is; None: nobody said until when."""
        return None if self.valid_until is None else (self.valid_until - today).days


@dataclass(frozen=True, slots=True)
class LimitConfig:
    """`[limits."<stream>.<channel>"]`, in the channel's unit. NaN fails every limit."""

    channel: str
    min: float | None = None
    max: float | None = None
    max_age: float | None = None
    """s; default max(3 sample periods, 0.2 s)."""
    max_frozen: float | None = None
    """s for which the value may stay the very same while the command is not 0 V. Default for the modelled thrust: 20
    times the longest such time so far, 2 s at least; for other channels: not judged. `inf` switches it off."""


@dataclass(frozen=True, slots=True)
class MountConfig:
    """`[mount]`: how the next thruster gets onto the bench. Empty command: the operator is asked."""

    command: tuple[str, ...] = ()
    """argv; `{thruster}` is replaced, `{bench_dir}` is the bench file's folder, `{python}` the interpreter."""
    timeout: float = 30.0

    def __post_init__(self) -> None:
        self.words("", Path())

    def words(self, thruster: str, bench_dir: Path) -> list[str]:
        """The command with its braces filled. Raises ValueError for braces that mean nothing."""
        fill = {"thruster": thruster, "bench_dir": str(bench_dir), "python": sys.executable}
        try:
            return [word.format(**fill) for word in self.command]
        except (KeyError, ValueError, IndexError) as error:
            raise ValueError(f"command has braces that mean nothing ({error}); known are {', '.join(fill)}") from error


@dataclass(frozen=True, slots=True)
class BenchConfig:
    """A bench file. `motor` and `force` name devices; `rotation_channel` tells rest from motion."""

    path: Path
    text: str
    """The file, verbatim, for the recording."""
    name: str
    motor: str
    force: str
    devices: Mapping[str, DeviceConfig]
    can: Mapping[str, CanBusConfig]
    limits: tuple[LimitConfig, ...]
    max_voltage: float
    """V, largest |command| allowed on this bench."""
    slew: float
    """V/s, fastest command change allowed on this bench."""
    facility: str = ""
    water_density: float | None = None
    loop_rate: float = 50.0
    """Hz of the control loop; also the command refresh."""
    watchdog_limit: float = 1.0
    """s; a motor controller whose own timeout is longer, unknown or not effective is refused."""
    rest_rate: float = 0.5
    """rev/s; |rotation_rate| below this is at rest."""
    rest_thrust: float | None = None
    """N; where no rotation rate is measured, thrust that is no farther from its tare is no push. None: rest is never
    confirmed there (decision 22)."""
    rest_current: float | None = None
    """A; there too, a current of no more drives nothing."""
    coast_time: float = 3.0
    """s a propeller may take from command 0 to rest before `STOP NOT CONFIRMED`."""
    proof_voltage: float = 4.0
    """V at which the motor's watchdog is proved: low, but enough to turn the propeller."""
    consistency: bool = True
    """Whether a run ends when command, rotation, current and thrust contradict each other (rig.safety.consistency)."""
    mount: MountConfig = field(default_factory=MountConfig)
    calibration: Mapping[str, CalibrationConfig] = field(default_factory=dict)
    """By the name of the device."""
    curves: Mapping[str, CalibratedCell] = field(default_factory=dict)
    """By the name of the device, where its calibration names a file."""
    overrides: Mapping[str, str] = field(default_factory=dict)
    """`[overrides]`: protection that this file takes away -> why (rig.campaign.disarmed)."""


@dataclass(frozen=True, slots=True)
class WatchConfig:
    """`[watch]`: the running campaign is watched for a mismatch (identification.watching)."""

    false_alarms_per_hour: float = 0.05
    """At most so many, on average, while nothing changes."""
    twin: str = ""
    """Path of a model known before the run, relative to the campaign file; `{thruster}` stands for the one under test.
    Empty: the static curve is learnt from the run itself."""
    off: bool = False
    stop: bool = False
    """An alarm ends the campaign in order, at zero. By default it is said, and the run goes on."""


@dataclass(frozen=True, slots=True)
class CampaignConfig:
    """A campaign file: which thrusters, which plan, how attended."""

    path: Path
    text: str
    name: str
    bench: BenchConfig
    thrusters: tuple[str, ...]
    plan: Plan
    """Iterating it yields the steps of one run."""
    output: Path
    """Folder for recordings; relative to the campaign file."""
    tare: TareConfig = field(default_factory=TareConfig)
    watch: WatchConfig = field(default_factory=WatchConfig)
    kind: str = "tunnel"
    operator: str = ""
    notes: str = ""
    unattended: bool = False
    expected_C: float | None = None
    """N/V^2, for the expected peak thrust of `rig check`; None: peak thrust is not checked and rig check says so."""
    prove_watchdog: bool = True
    overrides: Mapping[str, str] = field(default_factory=dict)
    """As in the bench file, for what this one takes away."""
    flow_speed: float | None = None
    """m/s that the campaign is meant for; the operator sets it. None: whatever it is."""


def twin_path(pattern: str, thruster: str) -> str:
    """`{thruster}` in the path stands for the thruster under test.

    >>> twin_path("twins/{thruster}.json", "T3")
    'twins/T3.json'
    """
    return pattern.replace("{thruster}", thruster)
