"""The bench in virtual time, from its wires: what is said arrives when line, adapter and computer let it."""

from dataclasses import replace
from itertools import pairwise
from math import exp
from pathlib import Path

import pytest

from sim_devices.bench.settings import load
from sim_devices.bench.virtual import BEGIN_NS, VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.tables import WorldError

WORLD = Path(__file__).parents[3] / "benches" / "simulated" / "world.toml"
DUTY = b"T000000174%08X\r"


QUICK = Host()


def bench(host: Host = QUICK, seed: int = 3, **devices) -> VirtualBench:
    settings = load(WORLD)
    return VirtualBench(replace(settings, seed=seed, devices={**settings.devices, **devices}, step=0.002), host, "bus0")


def listen(world: VirtualBench, name: str) -> list[tuple[float, bytes]]:
    heard: list[tuple[float, bytes]] = []
    world.wires[name].connect(lambda t_ns, data: heard.append(((t_ns - BEGIN_NS) * 1e-9, data)))
    return heard


def test_a_reading_has_been_on_its_line():
    world = bench()
    heard = listen(world, "load_cell")
    world.wires["load_cell"].write(b"SIR\r\n")
    world.sleep_until_ns(BEGIN_NS + 10**9)
    assert len(heard) == pytest.approx(92, abs=1)
    t, line = heard[10]
    assert len(line) == 18
    ticks = (t - 180 / 38400) * 92.0
    assert ticks == pytest.approx(round(ticks), abs=1e-6)
    assert world.now_ns() == BEGIN_NS + 10**9


def test_a_command_is_obeyed_when_it_has_come():
    world = bench(Host(work=0.001, adapter=0.0005))
    wire = world.wires["bus0"]
    heard = listen(world, "bus0")
    wire.write(b"C\rS6\rO\r" + DUTY % 25000)
    world.sleep_until_ns(BEGIN_NS + 10**8)
    assert world.commands == [(pytest.approx(0.0015), pytest.approx(12.0))]
    assert world.world.state.volts == pytest.approx(12.0)
    assert any(data.startswith(b"T00000917") for _, data in heard)


def test_the_loop_and_the_readers_are_late_and_no_stamp_goes_back():
    world = bench(Host(reader_late=0.002, loop_late=0.003, stall_every=0.3, stall=0.05))
    heard = listen(world, "load_cell")
    world.wires["load_cell"].write(b"SIR\r\n")
    late = []
    for i in range(1, 200):
        due = BEGIN_NS + i * 20_000_000
        world.sleep_until_ns(due)
        late.append((world.now_ns() - due) * 1e-9)
    assert min(late) >= 0.0
    assert max(late) > 0.02, "a stall holds the loop"
    stamps = [t for t, _ in heard]
    assert stamps == sorted(stamps)
    assert max(b - a for a, b in pairwise(stamps)) > 0.02, "and the readers"


def test_waiting_ends_when_something_has_come():
    world = bench()
    heard = listen(world, "flow")
    world.wait(5.0)
    assert len(heard) == 1
    assert world.now() < 0.5
    world.wires["flow"].disconnect()
    listen(world, "load_cell")
    before = world.now()
    world.wait(0.5)
    assert world.now() == pytest.approx(before + 0.5), "the cell says nothing unasked"


def test_the_same_seed_is_the_same_run():
    def played(seed: int) -> list[tuple[float, bytes]]:
        world = bench(Host(reader_late=0.001, stall_every=0.2, stall=0.01), seed)
        heard = listen(world, "load_cell")
        world.wires["load_cell"].write(b"SIR\r\n")
        world.sleep_until_ns(BEGIN_NS + 5 * 10**8)
        return heard

    assert played(1) == played(1) != played(2)


def test_one_motor_turns_the_thruster():
    settings = load(WORLD)
    still = {name: options for name, options in settings.devices.items() if name != "motor"}
    with pytest.raises(WorldError, match="one motor controller, this one 0"):
        VirtualBench(replace(settings, devices=still), Host(), "bus0")


def test_a_low_pass_is_there_between_two_conversions():
    """Behind 30 ms a cell of 92 readings/s shows the force as an RC of 30 ms does, worked out every quarter of a ms."""
    quiet = bench().settings
    quiet = replace(quiet, world=replace(quiet.world, noise={}))
    world = VirtualBench(quiet, QUICK, "bus0", {"load_cell": 0.03})
    heard = listen(world, "load_cell")
    world.wires["load_cell"].write(b"SIR\r\n")
    world.wires["bus0"].write(b"C\rS6\rO\r" + DUTY % 60000)
    dt, passed, course = 0.00025, 0.0, [0.0]
    for i in range(1, 1200):
        world.sleep_until_ns(BEGIN_NS + round(i * dt * 1e9))
        passed += (1 - exp(-dt / 0.03)) * (world.world.exact("thrust") - passed)
        course.append(passed)
    told = [(t - 180 / 38400, float(line.split()[2])) for t, line in heard if t > 0.02]
    largest = course[-1]
    assert largest > 5.0
    for t, value in told:
        assert value == pytest.approx(course[round(t / dt)], abs=0.03 * largest)
