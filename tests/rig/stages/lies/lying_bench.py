"""A campaign over real bytes in virtual time, on a simulated bench that begins to lie: what came of it, how soon."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from rig.cli import record_in_virtual_time
from rig.hdf5.load import load
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

ROOT = Path(__file__).parents[4]
CAMPAIGN = """
[campaign]
name = "lies"
bench = "bench.toml"
output = "out"
thrusters = ["T2"]
expected_C = 0.4
[watch]
off = true
[tare]
duration = 1.0
max_drift = 1.0
[plan]
kind = "levels"
voltages = [8.0, -8.0, 12.0, -12.0, 16.0, -16.0, 12.0, -12.0]
zero_every = 4
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = {dwell}
"""
FIRST = 8.0
"""V, of the first level."""
SETTLED = 2.0
"""s into a hold at which a lie begins: the check looks for jumps from 1.7 s on."""


@dataclass(frozen=True)
class Lie:
    """`volts` None: from before the devices are opened; else `SETTLED` s into the first hold of that voltage."""

    device: str
    fault: str
    amount: float = DEFAULT_AMOUNT
    volts: float | None = 12.0


@dataclass(frozen=True)
class Found:
    """What came of it."""

    outcome: str
    cause: str
    after: float
    """s from the lie to the first of the zeros that ended the run; of a lie from the start, since the first level
    began; 0 when it never did."""
    events: tuple[str, ...]


class LyingWorld:
    """The bench in virtual time; somebody puts the lie in while the controller sleeps."""

    def __init__(self, bench: VirtualBench, lie: Lie | None) -> None:
        self.bench, self.wires, self._lie = bench, bench.wires, lie
        self.begun: float | None = None
        if lie is not None and lie.volts is None:
            self._begin(lie)

    def now_ns(self) -> int:
        return self.bench.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self.bench.sleep_until_ns(t_ns)
        if self._lie is None or self.begun is not None or not self.bench.commands:
            return
        since, volts = self.bench.commands[-1]
        if abs(volts - (self._lie.volts or 0.0)) < 0.01 and self.bench.now() - since >= SETTLED:
            self._begin(self._lie)

    def _begin(self, lie: Lie) -> None:
        self.begun = self.bench.now()
        self.bench.fault(lie.device, lie.fault, lie.amount)


def files(folder: Path, dwell: float) -> Path:
    """The demo's bench, its samples allowed to be old, without the thermometer."""
    text = (ROOT / "benches" / "simulated" / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[devices.thermometer]")] + text[text.index('[limits."load_cell') : text.index("[mount]")]
    text = text.replace("min = -300.0 ", "max_age = 1.0\nmin = -300.0 ")
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN.format(dwell=dwell), encoding="utf-8")
    return folder / "campaign.toml"


def played(folder: Path, lie: Lie | None, dwell: float = 3.5, seed: int = 1) -> Found:
    settings = load_world(ROOT / "benches" / "simulated" / "world.toml")
    made = replace(settings, world=replace(settings.world, mounted="T2"), seed=seed, step=0.005)
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4)
    world = LyingWorld(VirtualBench(made, host, "bus0"), lie)
    try:
        record_in_virtual_time(files(folder, dwell), folder / "run", world, ("some-id", "2026-01-01"))
    except RuntimeError as error:
        refused = str(error)
    else:
        refused = ""
    recording = load(folder / "run" / "T2.h5") if (folder / "run" / "T2.h5").exists() else None
    if lie is not None:
        assert world.begun is not None, "the lie never began"
    last = max((t for t, volts in world.bench.commands if volts), default=0.0)
    zero = next((t for t, _ in world.bench.commands if t > last), last)
    first = next((t for t, volts in world.bench.commands if abs(volts - FIRST) < 0.01), zero)
    since = first if lie is None or lie.volts is None else world.begun or 0.0
    events = tuple(event.text for event in recording.events) if recording else ()
    outcome, cause = (recording.outcome, recording.cause) if recording else ("refused", refused)
    return Found(outcome, cause, zero - since, events)
