"""The command line: every command, its exit status, and the one place that reads argv and writes to the terminal.

Exit status: 0 done as asked, 1 the run ended otherwise than completed, 2 input that can't be used (one sentence why).
A command's module is imported when the command is called: `rig stop` shall not wait for scipy.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import click

from rig.errors import RigError
from rig.visible_text import visible_output

if TYPE_CHECKING:
    from rig.operate.virtual_time import World

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""What the libraries of linear algebra read when they are loaded."""


class Entry(NamedTuple):
    """Where a command is, and its line in the list of commands."""

    place: str
    """`module:attribute`"""
    help: str


COMMANDS: Final = {
    "check": Entry("rig.operate.check:check_command", "Check a campaign and its bench without opening a port."),
    "run": Entry("rig.operate.run:run_command", "Run a campaign on its bench: console, recording, table of the fits."),
    "resume": Entry(
        "rig.operate.resume:resume_command", "Go on with a campaign that was cut, at its first unfinished thruster."
    ),
    "console": Entry("rig.operate.run:console_command", "Attach to a run that is going on."),
    "stop": Entry("rig.operate.run:stop_command", "Stop a run that is going on: zero volts now, close the recording."),
    "design": Entry("rig.design.command:design_command", "Best levels, order and dwells for the time in the tunnel."),
    "calibrate": Entry(
        "rig.fit.load_cell:calibrate_command", "Scale, offset and uncertainty of a load cell from known weights."
    ),
    "fit": Entry("rig.fit.command:fit_command", "Fit tau = C V|V| to recordings."),
    "plot": Entry("rig.plot.command:plot_command", "One figure of a recording, as PNG, SVG or PDF."),
    "report": Entry(
        "rig.campaign_report.command:report_command",
        "One page of a whole campaign: results, uncertainty, figures, verdicts.",
    ),
    "diagnose": Entry(
        "rig.diagnose.command:diagnose_command", "Find, name and model the physics that C V|V| leaves out."
    ),
    "settle": Entry(
        "rig.operate.settle:settle_command", "Run the next experiment and diagnose again until one answer stands."
    ),
    "simulate": Entry("rig.twin.simulate:simulate_command", "The run of a plan that a twin predicts, as a recording."),
    "compare": Entry("rig.diagnose.compare:compare_command", "What a simulation leaves out relative to the real run."),
    "prove": Entry("rig.blind.command:prove_command", "Prove the diagnosis on recordings with concealed physics."),
    "vehicle": Entry(
        "rig.vehicle.command:vehicle_command", "Identify drag, efficiency and inertia of a vehicle from its trials."
    ),
    "import": Entry("rig.importing.command:import_command", "Make a recording of another program's table or log."),
    "recover": Entry(
        "rig.recording.recover:recover_command", "Copy a recording that was not closed in order into a plain file."
    ),
}


class LazyGroup(click.Group):
    """A group whose commands are the rows of COMMANDS."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """In the order of the table: the order of work."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        del ctx
        if cmd_name not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[cmd_name].place.partition(":")
        command: click.Command = getattr(import_module(module), attribute)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list in `rig --help`, from the table alone."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl([(name, entry.help) for name, entry in COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="thruster-rig", prog_name="rig")
def rig() -> None:
    """Calibrate thrusters on a test rig: sequence, record, identify."""


def main(arguments: list[str] | None = None) -> int:
    """Run one command; what is the input's fault is one sentence on stderr and status 2."""
    with visible_output():
        return _main(arguments)


def _main(arguments: list[str] | None) -> int:
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


def record_in_virtual_time(campaign: Path, folder: Path, world: World, stamp: tuple[str, str]) -> tuple[Path, int]:
    """For a program that brings a bench of its own (`python -m sim_devices`): `rig.operate.virtual_time.record`.

    Raises RuntimeError with a sentence for a campaign that can't be run, or a run that did not complete.
    """
    from rig.operate.virtual_time import record

    try:
        return record(campaign, folder, world, stamp)
    except RigError as error:
        raise RuntimeError(str(error)) from error


def entry() -> None:
    """The `rig` command, its children with it: linear algebra in one thread unless the environment says otherwise.

    Its matrices are long and narrow: a second thread doubles the work (8.8 s of processors instead of 4.4 for a
    diagnosis on two cores) and hardly shortens it; beside a control loop it is in the way.
    """
    for threads in ONE_THREAD:
        os.environ.setdefault(threads, "1")
    sys.exit(main())
