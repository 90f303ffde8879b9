"""`python -m rig.diagnose.next_from_answer CAMPAIGN FOLDER`: the next experiment of an answer, as a campaign file.

The answer (`thruster-rig-diagnosis`) comes on standard input, in one line. Standard output has one line of JSON:
`{"files": [PATH]}`, one for each flow speed, or `{"fault": TEXT}`. Nothing is overwritten.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.diagnose.next_plan import write_proposed
from rig.errors import ConfigError, RigError

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import NextExperiment

NUMBERED = "-[0-9]*"
"""What files of several flow speeds have between stem and suffix."""


def proposed_in(answer: Mapping[str, Any]) -> NextExperiment:
    """Raises ConfigError where there is none."""
    from identification.mismatch.diagnosis import NextExperiment, PlanStep

    told = answer["next_experiment"]
    if told is None:
        raise ConfigError("the diagnosis proposes no next experiment")
    if not told["steps"]:
        raise ConfigError(f"no sweep settles it: {told['why']}")
    quantity = "command_voltage" if "command_voltage" in told["steps"][0] else "rotation_rate"
    steps = tuple(PlanStep(step[quantity], step["duration"], step["flow_speed"]) for step in told["steps"])
    return NextExperiment(told["why"], steps, told["expected_power"], quantity)


def free_name(folder: Path, thruster: str) -> Path:
    """`next-THRUSTER.toml`, or with a number where that, or a file of one of its flow speeds, is there already."""
    stem = "next-" + re.sub(r"[^A-Za-z0-9._]+", "-", thruster).strip("-")
    names = (stem if number == 1 else f"{stem}.{number}" for number in count(1))
    return next(
        folder / f"{name}.toml"
        for name in names
        if not (folder / f"{name}.toml").exists() and not any(folder.glob(f"{name}{NUMBERED}.toml"))
    )


def write(answer: Mapping[str, Any], campaign: Path, folder: Path) -> tuple[Path, ...]:
    """Write it into `folder` under a name that is free; one file for each flow speed. Raises RigError."""
    from rig.campaign.loading import load_campaign

    thruster = str(answer["thruster"])
    return write_proposed(proposed_in(answer), thruster, load_campaign(campaign), free_name(folder, thruster))


def main(campaign: str, folder: str) -> None:
    """Of the answer on standard input."""
    try:
        told: dict[str, Any] = {
            "files": [str(file) for file in write(json.loads(sys.stdin.readline()), Path(campaign), Path(folder))]
        }
    except (RigError, OSError) as error:
        told = {"fault": str(error)}
    sys.stdout.write(json.dumps(told) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
