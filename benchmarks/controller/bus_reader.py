"""What full CAN buses behind slcan adapters cost the process that reads them, with nothing else in it.

    python benchmarks/controller/bus_reader.py [--buses 2] [--rate 7000] [--seconds 10]

Each bus is a pty on which `can_traffic.py` says RATE frames/s of others and a VESC that counts itself, a thousand a
second; the driver of that VESC is drained 50 times a second, as a control loop does. Prints frames/s, the share of one
core, and what the counts lack: 0 is nothing lost.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from full_buses import COUNTING

from drivers.ports.can_bus import CanBus
from drivers.protocols import Sample
from drivers.vesc.over_can import Options, VescCan

TRAFFIC = Path(__file__).parent / "can_traffic.py"
PERIOD = 0.02
"""s between two drains."""
OPTIONS = Options(
    "bus", vesc_id=COUNTING, pole_pairs=7, nominal_bus_voltage=48.0, watchdog_timeout=0.5, rate=50.0,
    supply_rate=1000.0, thermal_rate=0.0,
)  # fmt: skip


@contextmanager
def one_bus(link: Path, rate: float) -> Iterator[tuple[CanBus, VescCan]]:
    words = [sys.executable, str(TRAFFIC), str(link), str(rate), "--counting", str(COUNTING)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as traffic:
        assert traffic.stdout is not None
        traffic.stdout.readline()
        bus = CanBus("slcan", str(link), 1_000_000)
        bus.open()
        vesc = VescCan("motor", OPTIONS, bus)
        try:
            vesc.open()
            yield bus, vesc
        finally:
            bus.close()
            for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGTERM):
                traffic.send_signal(number)
            traffic.stdout.read()  # what it has to say of its host's buffer


def missing(samples: list[Sample]) -> int:
    """Counts between the first and the last that did not come."""
    counts = [sample.values[1] for sample in samples if sample.stream == "motor_supply"]
    return int(counts[-1] - counts[0]) + 1 - len(counts)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--buses", type=int, default=2)
    parser.add_argument("--rate", type=float, default=7000.0, help="frames/s of others on each")
    parser.add_argument("--seconds", type=float, default=10.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        every = [stack.enter_context(one_bus(Path(folder) / f"can{k}", asked.rate)) for k in range(asked.buses)]
        came: list[list[Sample]] = [[] for _ in every]
        before = sum(bus.health().received for bus, _ in every)
        begun, spent = time.monotonic(), time.process_time()
        while (took := time.monotonic() - begun) < asked.seconds:
            time.sleep(PERIOD)
            for rows, (_, vesc) in zip(came, every, strict=True):
                rows.extend(vesc.drain())
        spent, frames = time.process_time() - spent, sum(bus.health().received for bus, _ in every) - before
        print(
            f"{asked.buses} buses: {frames / took:,.0f} frames/s, {100 * spent / took:.1f} % of a core, "
            f"{1e6 * spent / frames:.1f} us a frame; counts missing: {sum(map(missing, came))}"
        )


if __name__ == "__main__":
    main()
