"""Does the 95 % interval of a calibration hold? Its budget beside GTC's, wrong weights found, a fit before and after.

    python benchmarks/calibration/coverage.py [RUNS] [WRONG]

RUNS (500) cells of the simulated world, each with a gain, bends, hysteresis, creep and noise of its own, under weights,
gravity, air and lever with errors of their own; WRONG (100) calibrations more with another weight in one step than was
typed. GTC comes with the extra `test`.
"""

from __future__ import annotations

import sys
from math import sqrt
from pathlib import Path
from time import process_time

import GTC
import numpy as np
from GTC import reporting

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from benchmarks.calibration.simulated_cells import (
    CORRELATION,
    DIGIT,
    PLACE,
    RANGE,
    SET,
    Drawn,
    course,
    drawn,
    read,
)
from identification.calibration.answer import CellCalibration, calibrated
from identification.calibration.estimate import estimated
from identification.calibration.loads import Load, force_of
from identification.calibration.model import CREEP, crept_beyond, straight_line
from identification.calibration.steps import Steps, lag_shape, side_of
from identification.recording import Channel, Floats, Recording, Step
from identification.thruster.thrust import ThrustFit, fit_thrust
from sim_devices.world import World

LEVELS = (0.3, 0.8, -0.6)
"""Of the range."""
STAIRCASE = (0.0, 8.0, -8.0, 14.0, -14.0, 18.0, -18.0, 21.0, -21.0, 12.0, -12.0, 0.0)
"""V"""


def answer(steps: Steps, loads: list[Load]) -> CellCalibration:
    return calibrated(steps, loads, SET, PLACE, correlation=CORRELATION, quantum=DIGIT)


def slope(force: Floats, reading: Floats) -> float:
    """Of the best straight line through the zero of that direction."""
    return float(np.trapezoid(force * (reading - reading[0]), force) / np.trapezoid(force**2, force))


def covered(runs: int) -> None:
    """Gain, and forces on the middle of the loop and on either branch."""
    held, marked, spent, widths = np.zeros(1 + 2 * len(LEVELS)), 0, 0.0, []
    for seed in range(runs):
        rng = np.random.default_rng([21, seed])
        cell, loads = drawn(rng), course()
        steps = read(cell, loads, rng)
        begun = process_time()
        found = answer(steps, loads)
        spent += process_time() - begun
        marked += bool(found.wrong)
        force, forward, backward = cell.truth()
        gain, zero = 0.5 * (slope(force, forward) - slope(force, backward)), 0.5 * (forward[0] + backward[0])
        held[0] += found.gain.low <= gain <= found.gain.high
        widths.append((found.gain.high - found.gain.low) / 2.0)
        for k, level in enumerate(LEVELS):
            true = level * RANGE
            branch = forward if level > 0 else backward
            said = float(np.interp(abs(true), force, branch)) - zero + found.curve.zero  # a run tares for itself
            side = cell.settings.cell.hysteresis * 4.0 * abs(level) * (1.0 - abs(level)) * rng.choice((-1.0, 1.0))
            for at, value in ((1 + k, said), (1 + len(LEVELS) + k, said + side)):
                _, low, high = found.force_interval(value)
                held[at] += low <= true <= high
    names = ["gain", *(f"force at {100 * each:+.0f} % of the range" for each in LEVELS)]
    names += [f"the same, read on a branch of the loop, {100 * each:+.0f} %" for each in LEVELS]
    print(f"{runs} calibrations of {len(course())} steps, {spent / runs * 1e3:.0f} ms of processor each")
    print(f"coverage of the 95 % interval (expected 95 +- {200 * sqrt(0.95 * 0.05 / runs):.1f} at two sigma)")
    for name, count in zip(names, held, strict=True):
        print(f"  {name:<55} {100 * count / runs:5.1f} %")
    print(f"half width of the gain's interval, median {np.median(widths):.2g}")
    print(f"sound calibrations in which a step was called wrong: {marked} of {runs}")


def beside_gtc() -> None:
    """The budget of one calibration, and the same regression in GTC's uncertain numbers."""
    rng = np.random.default_rng([21, 0])
    cell, loads = drawn(rng), course()
    steps = read(cell, loads, rng)
    found = answer(steps, loads)
    theirs, total = _by_gtc(found, steps, loads)
    print("\nbudget of the gain                ours        GTC")
    ours = {each.name: each.std for each in found.budget}
    for name, std in theirs.items():
        print(f"  {name:<30}  {ours.get(name, 0.0):.4e}  {std:.4e}")
    print(f"  {'combined':<30}  {found.gain.std:.4e}  {GTC.uncertainty(total):.4e}")
    print(f"  {'effective degrees of freedom':<30}  {found.gain.dof:10.1f}  {GTC.dof(total):10.1f}")
    print(f"  {'coverage factor':<30}  {found.gain.coverage:10.4f}  {reporting.k_factor(GTC.dof(total)):10.4f}")


def _by_gtc(found: CellCalibration, steps: Steps, loads: list[Load]) -> tuple[dict[str, float], object]:
    """Ordinary least squares of the means on the same terms but the creep, which the ordinary one has no rows for."""
    g, air = GTC.ureal(PLACE.gravity, PLACE.gravity_std), GTC.ureal(PLACE.air_density, PLACE.air_density_std)
    lever, rho = GTC.ureal(PLACE.lever, PLACE.lever_std), GTC.ureal(7950.0, 80.0)
    masses = {name: GTC.ureal(each.mass, each.std, independent=False) for name, each in SET.items()}
    listed = list(masses.values())
    for i, a in enumerate(listed):
        for b in listed[i + 1 :]:
            GTC.set_correlation(CORRELATION, a, b)
    per_kg = g * lever * (1 - air / rho) * (1 - 1.2 / 8000.0) / (1 - 1.2 / rho)
    force = [each.direction * per_kg * sum((masses[n] for n in each.weights), 0.0) for each in loads]
    gain = _gain(force, steps)
    digit = GTC.ureal(0.0, next((each.std for each in found.budget if each.name.startswith("resolution")), 0.0))
    scatter = GTC.ureal(0.0, found.budget[0].std, found.budget[0].dof)
    total = gain + digit + scatter
    by_mass = sqrt(sum(GTC.rp.u_component(gain, a) * GTC.rp.u_component(gain, b) *
                       (1.0 if a is b else CORRELATION) for a in listed for b in listed))  # fmt: skip
    single = {"local gravity": g, "density of the air": air, "density of the weights": rho, "lever arm": lever}
    out = {"repeatability and scatter": found.budget[0].std, "mass of the weights": by_mass}
    return out | {name: abs(GTC.rp.u_component(gain, each)) for name, each in single.items()}, total


def _gain(force: list[object], steps: Steps) -> object:
    """The straight line's slope as a sum of readings times uncertain weights: normal equations in GTC's numbers."""
    when = steps.time.mean(axis=1) / steps.time.max() - 0.5
    rows = [
        [1.0, f / 100, (f / 100) ** 2, (f / 100) * abs(f / 100), (f / 100) ** 3, w, s, d]
        for f, w, s, d in zip(force, steps.of_history(lag_shape), steps.of_history(side_of), when, strict=True)
    ]
    y = (steps.mean - _crept(steps)).tolist()
    p = len(rows[0])
    square = [[sum(row[i] * row[j] for row in rows) for j in range(p)] for i in range(p)]
    right = [sum(row[i] * each for row, each in zip(rows, y, strict=True)) for i in range(p)]
    for i in range(p):
        for k in range(i + 1, p):
            share = square[k][i] / square[i][i]
            square[k] = [a - share * b for a, b in zip(square[k], square[i], strict=True)]
            right[k] = right[k] - share * right[i]
    theta = [0.0] * p
    for i in reversed(range(p)):
        theta[i] = (right[i] - sum((square[i][j] * theta[j] for j in range(i + 1, p)), 0.0)) / square[i][i]
    line = straight_line(float(steps.force.min()), float(steps.force.max()))
    return sum(a * t / s for a, t, s in zip(line, theta[1:5], (1e2, 1e4, 1e4, 1e6), strict=True))


def _crept(steps: Steps) -> Floats:
    """N, (n,): what the found creep adds to the mean of each step."""
    fit = estimated(steps)
    both = [fit.value(name) * crept_beyond(steps, ages * steps.age).mean(axis=1) for name, ages in CREEP.items()]
    return np.asarray(sum(both, np.zeros(steps.count)))


def wrong_weights(runs: int) -> None:
    """One step at random in which another load hung than was typed."""
    flagged = right = named = alone = 0
    for seed in range(runs):
        rng = np.random.default_rng([22, seed])
        cell, typed = drawn(rng), course()
        hung, step = list(typed), int(rng.integers(len(typed)))
        while force_of(hung[step], SET, PLACE) == force_of(typed[step], SET, PLACE):
            names = tuple(name for name in SET if rng.random() < 0.4)
            hung[step] = Load(names, typed[step].direction)
        found = answer(read(cell, typed, rng, hung), typed).wrong
        flagged += bool(found)
        (match,) = [each for each in found if each.step == step] or (None,)
        right += match is not None
        alone += match is not None and len(found) == 1
        same = match is not None and match.probable is not None
        named += same and abs(force_of(match.probable, SET, PLACE) - force_of(hung[step], SET, PLACE)) < 1e-6
    print(f"\na wrong weight in one step of {runs} calibrations: flagged in {flagged}, that step in {right},")
    print(f"no other step in {alone}, and the weight that it was named (or one of the same mass) in {named}")


def staircase(cell: Drawn, rng: np.random.Generator) -> Recording:
    """Holds of a thruster on the world's stand, as the driver reads its cell."""
    world, rows, steps = World(cell.settings, rng), [], []
    for i, volts in enumerate(STAIRCASE):
        begun = world.state.t
        while world.state.t < begun + 8.0 - 1e-6:
            world.step(0.005, volts)
            if len(rows) * 0.02 <= world.state.t:
                rows.append((world.state.t, world.sample("thrust")))
        steps.append(Step(i, "hold", volts, begun + 2.0, world.state.t))
    table = np.array(rows)
    edges = np.array([8.0 * i for i in range(len(STAIRCASE))])
    command = Channel("command_voltage", "command", "command_voltage", "V", edges, np.array(STAIRCASE))
    cell_channel = Channel("thrust", "load_cell", "thrust", "N", table[:, 0], table[:, 1])
    return Recording("run", "T", (command, cell_channel), tuple(steps))


def through(run: Recording, facts: dict[str, object], found: CellCalibration | None) -> Recording:
    """The same run under another calibration."""
    (thrust,) = run.all_of("thrust")
    value = thrust.value if found is None else np.array([found.curve.force(float(each)) for each in thrust.value])
    read_as = Channel("thrust", "load_cell", "thrust", "N", thrust.time, value, calibration=facts)
    return Recording(run.recording_id, run.thruster, (run.channels[0], read_as), run.steps)


def before_and_after() -> None:
    """C of one run: no calibration, a certificate of 0.2 % that the cell does not keep, and its dead weights."""
    rng = np.random.default_rng([23, 1])
    cell, loads = drawn(rng), course()
    found = answer(read(cell, loads, rng), loads)
    run = staircase(cell, rng)
    cases = {
        "no calibration": through(run, {}, None),
        "gain_std = 0.002 stated": through(run, {"gain_std": 0.002}, None),
        "rig calibrate": through(run, {"gain_std": found.curve.gain_std, "curve": found.curve.as_json()}, found),
    }
    print(f"\na fit before and after (truth C = 0.4; this cell's gain is off by {cell.settings.cell.gain_error:+.2%})")
    for model in ("C V|V|", "C+/C-"):
        for name, each in cases.items():
            fit = fit_thrust([each], model)
            assert isinstance(fit, ThrustFit), fit
            for which, p in fit.parameters.items():
                holds = "holds" if p.low <= 0.4 <= p.high else "MISSES"
                print(
                    f"  {name:<24} {which:<8} {p.value:.6f} +- {p.std:.1e}: scatter {p.std_statistical:.1e}, "
                    f"calibration {p.std_calibration:.1e}; 95 % {p.low:.5f} to {p.high:.5f} {holds}"
                )


def main() -> None:
    words = [int(word) for word in sys.argv[1:]]
    beside_gtc()
    before_and_after()
    wrong_weights(words[1] if len(words) > 1 else 100)
    covered(words[0] if words else 500)


if __name__ == "__main__":
    main()
