"""Bad input, and what is said about it: by the library, and by `rig fit` on real HDF5 files. Nothing may trace back.

    python examples/bad_input.py

Each case is given to the library as arrays (`judge`, `fit_thrust`, `derivative`) and to `rig fit` as a file written
the way another program would write it. The last line counts; the exit status is 1 when something other than a
sentence came out.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from identification.estimation.judgement import judge
from identification.recording import Channel, Recording
from identification.thruster.thrust import fit_thrust
from identification.thruster.thrust_data import Unusable
from identification.velocity.velocity import Window, derivative

Floats = NDArray[np.float64]
RATE = 50.0
HOLD = 100
LEVELS = (0.0, 6.0, -6.0, 12.0, -12.0, 0.0)


@dataclass(frozen=True)
class Bad:
    """One recording with something wrong with it."""

    name: str
    command_time: Floats
    command: Floats
    time: Floats
    thrust: Floats


def _run(name: str, levels: tuple[float, ...], noise: float = 0.3) -> Bad:
    V = np.repeat(np.array(levels), HOLD)
    t = np.arange(V.size) / RATE
    F = 0.4 * V * np.abs(V) + 1.5 + noise * np.random.default_rng(0).standard_normal(V.size)
    return Bad(name, np.arange(len(levels)) * HOLD / RATE, np.array(levels), t, F)


def cases() -> tuple[Bad, ...]:
    """One thing wrong in each, and a good one to compare with."""
    good = _run("good, for comparison", LEVELS)
    holes, gone, infinite = good.thrust.copy(), np.full(good.thrust.size, np.nan), good.thrust.copy()
    holes[::3] = np.nan
    infinite[10] = np.inf
    back, unruly = good.time.copy(), good.time.copy()
    back[[200, 201]] = back[[201, 200]]
    unruly[50] = np.nan

    def with_thrust(name: str, thrust: Floats) -> Bad:
        return Bad(name, good.command_time, good.command, good.time, thrust)

    quiet = _run("zero variance: every sample of a hold alike", LEVELS, noise=0.0)
    lost = np.array([0.0, np.nan, np.nan, np.nan, np.nan, np.nan])
    few = Bad("fewer points than parameters", np.zeros(1), np.array([6.0]), np.zeros(1), np.array([15.9]))
    return (
        good,
        _run("constant command", (6.0,)),
        _run("one level, started twice", (6.0, 6.0)),
        _run("one level and its negative, no rest", (6.0, -6.0)),
        with_thrust("NaN in every third sample", holes),
        with_thrust("nothing but NaN", gone),
        with_thrust("one infinite sample", infinite),
        Bad("command unknown from the second hold on", good.command_time, lost, good.time, good.thrust),
        quiet,
        with_thrust("zero variance: a cell that is stuck", np.full(good.thrust.size, 1.5)),
        few,
        Bad("no samples at all", np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0)),
        Bad("rows out of order", good.command_time, good.command, back, good.thrust),
        Bad("a time that is not a number", good.command_time, good.command, unruly, good.thrust),
    )


def said(step: Callable[[], str]) -> str:
    """What a library call says: its verdict, or its ValueError. Anything else is a fault of the library."""
    try:
        return step()
    except ValueError as error:
        return f"ValueError: {error}"


def by_regression(bad: Bad) -> str:
    """Least squares on the samples; the command held between its rows."""
    if bad.command.size:
        at = np.searchsorted(bad.command_time, bad.time, side="right") - 1
        V = bad.command[np.maximum(at, 0)]
    else:
        V = np.zeros(bad.time.size)
    H = np.column_stack([V * np.abs(V), np.ones(V.size)])
    return "; ".join(judge(H, bad.thrust, ("C", "tare")).statements)


def by_thruster_fit(bad: Bad) -> str:
    command = Channel("u", "command", "command_voltage", "V", bad.command_time, bad.command)
    cell = Channel("f", "load_cell", "thrust", "N", bad.time, bad.thrust)
    fit = fit_thrust([Recording("bad", "T1", (command, cell))])
    if isinstance(fit, Unusable):
        return fit.reason
    C, judged = fit.parameters["C"], fit.estimate.underfit
    verdict = "not judged" if judged is None else judged.statement
    return f"C = {C.value:.4g} ± {C.std:.2g} N/V^2, {fit.skipped} samples left out, {verdict}"


def by_derivative(bad: Bad) -> str:
    return derivative(bad.time, bad.thrust, Window(10, 10)).statement


def write(path: Path, bad: Bad) -> Path:
    """As another program would write it: no check of anything."""
    with h5py.File(path, "w") as file:
        file.attrs.update(format="thruster-rig-recording", format_version=1, recording_id=path.stem)
        file.attrs.update(created="2026-01-01T00:00:00Z", complete=True, outcome="completed", thruster="T1")
        for stream, name, quantity, unit, time, value in (
            ("command", "command_voltage", "command_voltage", "V", bad.command_time, bad.command),
            ("load_cell", "thrust", "thrust", "N", bad.time, bad.thrust),
        ):
            group = file.create_group(f"streams/{stream}")
            group["time"] = time
            group[name] = value
            group[name].attrs.update(quantity=quantity, unit=unit)
    return path


def by_command(path: Path) -> tuple[int, str]:
    """Exit status and words of `rig fit`."""
    root = Path(__file__).resolve().parents[1]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "from rig.cli import entry; entry()", "fit", str(path)],
        capture_output=True,
        text=True,
        cwd=root,
        check=False,
    )
    return done.returncode, (done.stdout + done.stderr).strip()


def main() -> int:
    traced = 0
    with tempfile.TemporaryDirectory() as folder:
        for number, bad in enumerate(cases()):
            print(f"\n== {bad.name}")
            for name, step in (
                ("judge", by_regression),
                ("fit_thrust", by_thruster_fit),
                ("derivative", by_derivative),
            ):
                print(f"  {name:10s} {said(lambda step=step, bad=bad: step(bad))}")
            status, words = by_command(write(Path(folder) / f"bad-{number}.h5", bad))
            words = words.replace(folder, "").replace("/bad-", "bad-")
            traced += "Traceback" in words or status not in (0, 2)
            shown = words if status == 2 else words.splitlines()[0] if words else "(nothing)"
            print(f"  rig fit    (exit status {status}) {shown}")
    print(f"\n{len(cases())} inputs, {traced} traced back")
    return 1 if traced else 0


if __name__ == "__main__":
    raise SystemExit(main())
