"""A bench in virtual time, one of whose devices gets a fault while the motor is driven."""

from __future__ import annotations

from sim_devices.bench.virtual import VirtualBench


class Faulty:
    """The clock and wires of a bench; once the motor has been driven with `volts` for `after` s there is the fault."""

    def __init__(self, bench: VirtualBench, *fault: str | float, volts: float = 12.0, after: float = 2.0) -> None:
        """`fault`: of which device, its name, and how large it is where that is asked for."""
        self.bench, self.wires, self._fault, self._volts, self._after = bench, bench.wires, fault, volts, after
        self.begun: float | None = None

    def now_ns(self) -> int:
        return self.bench.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self.bench.sleep_until_ns(t_ns)
        if self.begun is None and self.bench.commands:
            since, volts = self.bench.commands[-1]
            if abs(volts - self._volts) < 0.1 and self.bench.now() - since > self._after:
                self.begun = self.bench.now()
                self.bench.fault(*self._fault)
