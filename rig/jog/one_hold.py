"""The campaign of one hold that `rig jog` runs, as a file; and how much it may command."""

from __future__ import annotations

import json
from math import isfinite
from pathlib import Path

from rig.campaign.config import BenchConfig
from rig.errors import ConfigError, PlanError

SHARE = 0.15
"""Of bench.max_voltage that is commanded by hand unless the operator gives another limit: thrust goes as its square,
so that this is some 2 % of the most."""
LONGEST = 60.0
"""s of one hold by hand."""
RISE = 1.0
"""s from 0 to the voltage, where the bench's slew allows it."""
NAME = "jog"

CAMPAIGN = """# Written by `rig jog`: one hold by hand.
[campaign]
name = "jog"
bench = {bench}
output = "."
thrusters = [{thruster}]
notes = "held by hand with rig jog, to see wiring and direction"
prove_watchdog = {proved}

[watch]
off = true

[tare]
duration = 1.5
max_std_error = 10.0       # N: a direction is asked for, no measurement
max_drift = 10.0           # N/s

[plan]
kind = "levels"
voltages = [{volts!r}]
slew = {slew!r}

[plan.dwell]
kind = "fixed"
duration = {seconds!r}
"""


def require_small(bench: BenchConfig, volts: float, limit: float | None) -> None:
    """Raises PlanError for a voltage that is none, or is more than is commanded by hand."""
    allowed = SHARE * bench.max_voltage if limit is None else limit
    if limit is not None and not 0.0 < limit <= bench.max_voltage:
        raise PlanError(
            f"--limit must be above 0 and at most bench.max_voltage ({bench.max_voltage:g} V), not {limit:g}"
        )
    if not isfinite(volts) or volts == 0.0:
        raise PlanError(f"a jog needs a voltage other than 0, not {volts:g}")
    if abs(volts) > allowed:
        whose = f"{SHARE:.0%} of bench.max_voltage" if limit is None else "--limit"
        raise PlanError(
            f"{volts:g} V is more than the {allowed:g} V that a jog allows ({whose}): lower it, or give a higher"
            " --limit if nobody can reach the propeller"
        )


def thruster_of(bench: BenchConfig, asked: str) -> str:
    """Raises ConfigError where the bench would mount one, and nobody said which."""
    if bench.mount.command and not asked:
        raise ConfigError(f"{bench.path} mounts the thruster by a command: say which one with --thruster")
    return asked or NAME


def write(
    folder: Path, bench: BenchConfig, thruster: str, volts: float, seconds: float, unproved: str | None = None
) -> Path:
    """The campaign file in `folder`. `unproved`: why the watchdog is not proved before."""
    text = CAMPAIGN.format(
        bench=json.dumps(str(bench.path.resolve())),
        thruster=json.dumps(thruster),
        proved="true" if unproved is None else "false",
        volts=float(volts),
        slew=min(bench.slew, abs(volts) / RISE),
        seconds=float(seconds),
    )
    if unproved is not None:
        text += f'\n[overrides]\n"campaign.prove_watchdog" = {json.dumps(unproved)}\n'
    path = folder / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    return path
