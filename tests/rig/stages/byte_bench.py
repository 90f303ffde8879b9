"""The demo's bench over real bytes in virtual time, with somebody who looks on while the controller sleeps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from drivers.ports.wire import Wire
from identification.recording import Recording
from rig.cli import record_in_virtual_time
from rig.hdf5.load import load
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host

ROOT = Path(__file__).parents[3]


class Watched:
    """A bench whose `look` is called whenever the controller has slept; the recorder had its turn before."""

    def __init__(self, bench: VirtualBench, look: Callable[[VirtualBench], None]) -> None:
        self.bench, self._look = bench, look
        self.wires: Mapping[str, Wire] = bench.wires

    def now_ns(self) -> int:
        return self.bench.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self._look(self.bench)
        self.bench.sleep_until_ns(t_ns)


def nothing(_bench: VirtualBench) -> None: ...


def byte_bench(seed: int = 1) -> VirtualBench:
    settings = load_world(ROOT / "benches" / "simulated" / "world.toml")
    made = replace(settings, world=replace(settings.world, mounted="T2"), seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "bus0")


def recorded(
    campaign: Path, folder: Path, look: Callable[[VirtualBench], None] = nothing, seed: int = 1
) -> tuple[Recording, int]:
    """The recording of a campaign that completes, and ns of its t = 0."""
    world = Watched(byte_bench(seed), look)
    path, t0_ns = record_in_virtual_time(campaign, folder, world, ("some-id", "2026-01-01"))
    return load(path), t0_ns
