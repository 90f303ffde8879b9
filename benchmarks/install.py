"""What an installation takes: the base, and what each extra adds; and what a bench of a missing extra is told.

    python benchmarks/install.py [EXTRA ...]

Builds the wheel, installs it into a new environment by pip, then each extra into one that has the base before it. Times
are of this machine and its network; sizes are what lies on the disk.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
NOT_FOR_USERS = ("test", "benchmark")
BENCHES = {"canopen": "cia402", "dronecan": "dronecan", "dbc": "odrive"}
"""Of extras that a bench may ask for: a bench of the project; that of `dbc` gets a torque cell beside it."""
TORQUE = """
[devices.torque]
kind = "can_signals"
bus = "bus0"
map = "torque.toml"
"""
MAP = """title = "a torque cell"
source = "of its own making"
dbc = "torque.dbc"
rates = {TORQUE = 100.0}
channels.torque = {signal = "TORQUE.torque", unit = "N.m", quantity = "torque"}
"""


def ran(*command: str | Path) -> str:
    """Its output, also of one that fails."""
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, cwd=tempfile.gettempdir())
    return done.stdout + done.stderr


def environment(folder: Path, below: Path | None = None) -> Path:
    """Site-packages of a new environment; what is in those `below` counts as installed."""
    ran(sys.executable, "-m", "venv", folder)
    (site,) = folder.glob("lib/python*/site-packages")
    if below is not None:
        (site / "below.pth").write_text(f"{below}\n", encoding="utf-8")
    return site


def megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def installed(folder: Path, wanted: str) -> float:
    """s"""
    begun = time.monotonic()
    said = ran(folder / "bin" / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wanted)
    if "ERROR" in said:
        raise SystemExit(f"{wanted}: {said[-2000:]}")
    return time.monotonic() - begun


def campaign_of(extra: str, root: Path) -> Path:
    """A campaign on a bench that asks for the extra."""
    folder = root / f"bench-{extra}"
    folder.mkdir()
    bench = (PROJECT / "benches" / BENCHES[extra] / "bench.toml").read_text(encoding="utf-8")
    (folder / "bench.toml").write_text(bench + (TORQUE if extra == "dbc" else ""), encoding="utf-8")
    (folder / "torque.toml").write_text(MAP, encoding="utf-8")
    (folder / "torque.dbc").write_text('VERSION ""\n', encoding="utf-8")
    campaign = (PROJECT / "campaigns" / "staircase.toml").read_text(encoding="utf-8")
    made = folder / "campaign.toml"
    made.write_text(re.sub(r"(?m)^bench = .*$", 'bench = "bench.toml"', campaign), encoding="utf-8")
    return made


def main(asked: list[str]) -> int:
    extras = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    with tempfile.TemporaryDirectory() as where:
        root = Path(where)
        build = ran(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", root, PROJECT)
        (wheel,) = root.glob("thruster_rig-*.whl")
        print(f"wheel: {wheel.stat().st_size / 1e6:.1f} MB{' (pip said something)' if 'ERROR' in build else ''}")
        base = environment(root / "base")
        empty = megabytes(base)
        took = installed(root / "base", str(wheel))
        print(f"{'':12}{'s':>8}{'MB':>8}  packages")
        count = len(list(base.glob("*.dist-info"))) - 2
        print(f"{'base':12}{took:>8.0f}{megabytes(base) - empty:>8.0f}  {count}", flush=True)
        for extra in asked or [name for name in extras if name not in NOT_FOR_USERS]:
            site = environment(root / extra, base)
            took = installed(root / extra, f"{wheel}[{extra}]")
            added = sorted(path.name.split("-")[0] for path in site.glob("*.dist-info"))
            added = [name for name in added if name not in ("pip", "setuptools", "thruster_rig")]
            print(f"{extra:12}{took:>8.0f}{megabytes(site) - empty:>8.0f}  {', '.join(added)}", flush=True)
        print("\na bench that asks for what is not installed:")
        for extra in BENCHES:
            said = ran(root / "base" / "bin" / "rig", "check", campaign_of(extra, root))
            print(f"  {extra}: {said.strip().replace(str(root), 'FOLDER')}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
