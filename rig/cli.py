"""The command line: every command, its exit status, and the one place that reads argv and writes to the terminal.

Exit status: 0 done as asked, 1 the run ended otherwise than completed, 2 input that can't be used (one sentence why).
"""

from __future__ import annotations

import sys

import click

from rig.check import check_command
from rig.errors import RigError
from rig.fit import fit_command
from rig.importer import import_command
from rig.recover import recover_command
from rig.run import console_command, run_command, stop_command


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="thruster-rig", prog_name="rig")
def rig() -> None:
    """Calibrate thrusters on a test rig: sequence, record, identify."""


for command in (
    check_command,
    run_command,
    console_command,
    stop_command,
    fit_command,
    import_command,
    recover_command,
):
    rig.add_command(command)


def main(arguments: list[str] | None = None) -> int:
    """Run one command; what is the input's fault is one sentence on stderr and status 2."""
    try:
        result = rig.main(arguments, prog_name="rig", standalone_mode=False)
    except RigError as error:
        click.echo(f"rig: {error}", err=True)
        return 2
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.Abort:
        click.echo("rig: interrupted", err=True)
        return 130
    return int(result or 0)


def entry() -> None:
    """The `rig` command."""
    sys.exit(main())
