"""What `rig diagnose` makes of a sound run on each bench of benches/, recorded through its drivers, bytes and stamps.

    python benchmarks/diagnosis/own_benches.py [BENCH ...] [--seeds 1]

Nothing is concealed: what is named is what the drive and its wires do. One line for each run: what was named, the
verdict, C beside the world's (times the gain of its cell), and the error on what was not fitted beside the noise.
"""

from __future__ import annotations

import argparse
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from identification.mismatch.answer.as_json import diagnosis_json
from rig.cli import record_in_virtual_time
from rig.diagnose.command import diagnose_files
from sim_devices.bench.settings import load
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host

BENCHES = Path(__file__).resolve().parents[2] / "benches"
THRUSTER = "T2"
SERIAL = ("maestro", "roboteq", "scpi_supply", "smc_g2", "vesc_uart")
"""Benches without a CAN bus."""
STEP = 0.001
"""s of the world: as fine as the quickest of the cells looks (575 a second)."""
MOST = {"cia401": 8.0}
"""V of the largest level, where it is not 20."""
GAIN = {"cia401": 2.4}
"""V of the motor for one of the command, where an amplifier stands between."""
UNPROVED = ("cia401",)
"""Neither rate nor current is measured: the watchdog can't be proved."""
FORWARDS = ("scpi_supply",)
"""A supply gives no negative voltage."""
CAMPAIGN = """
[campaign]
name = "sound"
bench = "bench.toml"
output = "out"
thrusters = ["{thruster}"]
expected_C = {C}
{proof}
[watch]
off = true
[tare]
duration = 1.5
max_drift = 0.2
[plan]
kind = "levels"
voltages = {volts}
zero_every = 4
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 2.5
{overrides}
"""
OVERRIDES = """[overrides]
"campaign.prove_watchdog" = "this arrangement measures no rotation rate"
"""


def levels(name: str) -> list[float]:
    """Rising, the signs in turn."""
    sizes = [round(MOST.get(name, 20.0) * k / 6, 3) for k in range(1, 7)]
    return sizes if name in FORWARDS else [sign * size for size in sizes for sign in (1.0, -1.0)]


def recorded(name: str, seed: int, folder: Path) -> tuple[Path, float]:
    """The recording of a run, and what C is there."""
    settings = load(BENCHES / name / "world.toml")
    bench = (BENCHES / name / "bench.toml").read_text(encoding="utf-8")
    (folder / "bench.toml").write_text(bench[: bench.index("[mount]")], encoding="utf-8")
    truth = settings.world.thrusters[THRUSTER].C * (1 + settings.world.cell.gain_error) * GAIN.get(name, 1.0) ** 2
    proof, overrides = ("prove_watchdog = false", OVERRIDES) if name in UNPROVED else ("", "")
    campaign = CAMPAIGN.format(
        thruster=THRUSTER, volts=levels(name), C=round(truth, 1), proof=proof, overrides=overrides
    )
    (folder / "campaign.toml").write_text(campaign, encoding="utf-8")
    made = replace(settings, world=replace(settings.world, mounted=THRUSTER), seed=seed, step=STEP)
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4)
    world = VirtualBench(made, host, "none" if name in SERIAL else "bus0")
    with suppress(RuntimeError):  # where too little is measured to say that it is at rest a run ends as tripped
        record_in_virtual_time(folder / "campaign.toml", folder / "run", world, ("id", "2026-01-01"))
    return folder / "run" / f"{THRUSTER}.h5", truth


def told(found: dict[str, Any], truth: float) -> str:
    C, held = found["model"]["parameters"]["C"], found["fit"]["heldout"]
    named = ", ".join(f"{each['effect']} {each['form']}".strip() for each in found["findings"]) or "nothing"
    off = 100 * (C["value"] / truth - 1)
    return (
        f"{found['verdict']} | {named} | {C['value']:.5f} +- {C['std']:.2g} | {off:+.3f} % | "
        f"{held['rmse_before']:.3g} -> {held['rmse_after']:.3g} ({held['noise']:.3g})"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("benches", nargs="*", default=sorted(each.parent.name for each in BENCHES.glob("*/world.toml")))
    parser.add_argument("--seeds", type=int, default=1)
    asked = parser.parse_args()
    print("| bench | seed | verdict | named | C, N/V^2 | off | not fitted, N: before -> after (noise) |")
    print("|---|---|---|---|---|---|---|")
    for name in asked.benches:
        for seed in range(1, asked.seeds + 1):
            with tempfile.TemporaryDirectory() as folder:
                path, truth = recorded(name, seed, Path(folder))
                print(f"| {name} | {seed} | {told(diagnosis_json(diagnose_files([path])), truth)} |", flush=True)


if __name__ == "__main__":
    main()
