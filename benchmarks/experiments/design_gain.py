"""What `rig design` gains: designed against plain plans of the same time on the simulated bench, in virtual time.

    python benchmarks/experiments/design_gain.py [runs] [drift in N an hour]

Each plan is run with other noise `runs` times and fitted as `rig fit` does; the scatter of C is compared with the
promise. The drift is added to the thrust as a straight line, whose sign changes from run to run.
"""

import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

from identification.experiment_design.run_order import Course, Slow
from identification.experiment_design.thrust_design import Noise, Terms
from identification.recording import Channel, Recording
from identification.recording import Step as Row
from identification.thruster.thrust import ThrustFit, fit_thrust
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.plan_file import Template
from rig.campaign.shapes import Interleaved, Staircase
from rig.design.baselines import LEVELS, filling, judge
from rig.design.command import plan_of
from rig.design.optimal_levels import Ask
from rig.design.plan import choose
from sim_devices.world.headless import run
from sim_devices.world.settings import WorldSettings, read_world

WORLD = Path(__file__).parents[2] / "benches" / "simulated" / "world.toml"
RAMP = 0.02
"""s between commands in a ramp: the loop's period."""


def recorded(plan: Plan, settings: WorldSettings, rng: np.random.Generator, drift_per_s: float) -> Recording:
    """The plan on the simulated bench."""
    at, rows, times, volts = 0.0, [], [0.0], [0.0]
    for step in plan:
        end = at + step.expected
        if step.phase == "ramp":
            new = np.append(np.arange(at, end, RAMP)[1:], end)
            times += new.tolist()
            volts += np.interp(new, [at, end], [step.from_voltage, step.voltage]).tolist()
        else:
            rows.append(Row(step.index, step.phase, step.voltage, at, end))
        at = end
    trace = run(settings, times, volts, at, rates={"thrust": 92.0}, rng=rng)["thrust"]
    command = Channel("u", "command", "command_voltage", "V", np.array(times), np.array(volts))
    cell = Channel("f", "load_cell", "thrust", "N", trace.time, trace.value + drift_per_s * trace.time)
    return Recording("run", "T1", (command, cell), steps=tuple(rows))


def main(runs: int, drift: float) -> None:
    tables = tomllib.loads(WORLD.read_text())
    settings = read_world({key: tables[key] for key in ("thrusters", "tunnel", "supply", "cell", "noise")})
    tare, total = TareConfig(3.0), 240.0
    course = Course(12.0, 4, 1.0, tare.duration, 1.0)
    # thrust noise of the world in one second: white 0.05 N at 92/s; slow 0.02 N, 0.5 s; 0.001 of the thrust at 92/s
    noise = Noise(float(np.hypot(0.05 / 92**0.5, 0.02)), 0.001 / 92**0.5)
    slow = Slow(max(drift * total / 3600, 1e-6))
    ask = Ask(Terms(0.412), noise, np.linspace(-20, 20, 41), total, course, slow=slow)
    template = Template("", Path(), ("T1",), Path(), 12.0, tare, 1.0)
    plans = {
        "designed": plan_of(choose(ask), template),
        "designed, no check levels": plan_of(choose(replace(ask, check_levels=0)), template),
        "staircase": filling(Staircase(20.0, LEVELS), ask, tare),
        "interleaved": filling(Interleaved(20.0, LEVELS), ask, tare),
    }
    print(f"{runs} runs of {total:g} s, drift {drift:g} N/h")
    print(f"{'':28}{'promised':>10}{'achieved':>10}{'said':>10}{'bias':>11}{'rms':>10}   10^-6 N/V^2")
    for name, plan in plans.items():
        assert plan is not None
        judged = judge(name, plan, ask)
        assert judged is not None
        errors, said = [], []
        for seed in range(runs):
            sign = 1.0 if seed % 2 else -1.0
            recording = recorded(plan, settings, np.random.default_rng(seed), sign * drift / 3600)
            fit = fit_thrust([recording])
            assert isinstance(fit, ThrustFit)
            found = fit.parameters["C"]
            errors.append(found.value - 0.4120 * (1 + 0.0002))
            said.append(found.std_statistical)
        e = 1e6 * np.array(errors)
        numbers = (1e6 * judged.promise.std[0], e.std(ddof=1), 1e6 * np.median(said), e.mean(), np.sqrt(np.mean(e**2)))
        print(f"{name:28}" + "".join(f"{x:10.2f}" for x in numbers))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40, float(sys.argv[2]) if len(sys.argv) > 2 else 0.0)
