"""From a speed of the water to the water at that speed: by the operator, or by a command of the facility."""

from __future__ import annotations

import shlex
import subprocess
from collections.abc import Callable

import click

from rig.errors import ConfigError, RigError

FLOW_PATIENCE = 300.0
"""s that a command may take to bring the water to its speed."""

SetFlow = Callable[[float], None]
"""Brings the water to a speed in m/s. Raises RigError."""


def by_hand(speed: float) -> None:
    """An operator sets the flow."""
    click.prompt(f"set the flow to {speed:g} m/s, then press Enter", default="", show_default=False, err=True)


def by_command(command: str) -> SetFlow:
    """A command sets it; `{speed}` in it stands for m/s. Raises ConfigError for what no shell could split."""
    try:
        pattern = shlex.split(command)
    except ValueError as error:
        raise ConfigError(f"--flow {command}: {error}; expected a program and its arguments") from error
    if not pattern:
        raise ConfigError("--flow is empty; expected a program and its arguments")

    def set_flow(speed: float) -> None:
        words = [word.replace("{speed}", f"{speed:g}") for word in pattern]
        try:
            done = subprocess.run(
                words, capture_output=True, text=True, errors="replace", timeout=FLOW_PATIENCE, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise RigError(f"--flow: {words} could not set {speed:g} m/s: {error}") from error
        if done.returncode:
            said = (done.stderr or done.stdout).strip()[-500:]
            raise RigError(f"--flow: {words} ended with status {done.returncode}: {said}")

    return set_flow
