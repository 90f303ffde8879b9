"""The command line: every command, its exit status, and the one place that reads argv and writes to the terminal.

Exit status: 0 done as asked, 1 the run ended otherwise than completed, 2 input that can't be used (one sentence why).
A command's module is imported when the command is called: `rig stop` shall not wait for scipy.
"""

from __future__ import annotations

import difflib
import os
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import click

from rig.errors import RigError
from rig.visible_text import visible_output

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from rig.operate.virtual_time import World

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""What the libraries of linear algebra read when they are loaded."""


GROUPS: Final = {
    "measure": "Measure on a bench",
    "identify": "Identify tau = C V|V|",
    "diagnose": "Diagnose what the model leaves out",
    "vehicles": "Vehicles",
    "data": "Data in, out, and saved from a crash",
    "develop": "Develop the diagnosis",
}
"""What a person wants to do, in the order of `rig --help`, and its heading there."""

FIRST: Final = "A first campaign: rig init. What a command does and takes: rig COMMAND --help."

COMPLETING: Final = "_RIG_COMPLETE"
"""Set by a shell that asks what the Tab key offers (docs/howto/first-steps.md)."""


class Entry(NamedTuple):
    """Where a command is, and its line in the list of commands."""

    place: str
    """`module:attribute`"""
    help: str
    group: str = "data"
    """One of GROUPS."""


COMMANDS: Final = {
    "init": Entry("rig.first_steps.command:init_command", "Make a bench, a world and a campaign to edit.", "measure"),
    "devices": Entry(
        "rig.devices.command:devices_command", "Who is on a port or bus, and a bench file to start from.", "measure"
    ),
    "check": Entry(
        "rig.operate.check:check_command", "Check a campaign and its bench without opening a port.", "measure"
    ),
    "edit": Entry("rig.operate.edit:edit_command", "Edit a campaign in a form, with its dry run beside it.", "measure"),
    "run": Entry(
        "rig.operate.run:run_command", "Run a campaign on its bench: console, recording, table of the fits.", "measure"
    ),
    "jog": Entry(
        "rig.jog.command:jog_command", "Hold a small voltage by hand: which way do force and rotation go?", "measure"
    ),
    "resume": Entry(
        "rig.operate.resume:resume_command",
        "Go on with a campaign that was cut, at its first step that is not measured.",
        "measure",
    ),
    "console": Entry(
        "rig.serve.command:console_command", "Attach to a run that is going on, here or in a browser.", "measure"
    ),
    "stop": Entry(
        "rig.operate.run:stop_command", "Stop a run that is going on: zero volts now, close the recording.", "measure"
    ),
    "design": Entry(
        "rig.design.command:design_command", "Best levels, order and dwells for the time in the tunnel.", "measure"
    ),
    "calibrate": Entry(
        "rig.calibrate.command:calibrate_command",
        "A load cell from dead weights: curve, uncertainty, what is wrong with a step.",
        "measure",
    ),
    "fit": Entry("rig.fit.command:fit_command", "Fit tau = C V|V| to recordings.", "identify"),
    "plot": Entry("rig.plot.command:plot_command", "One figure of a recording, as PNG, SVG or PDF.", "identify"),
    "report": Entry(
        "rig.campaign_report.command:report_command",
        "One page of a whole campaign: results, uncertainty, figures, verdicts.",
        "identify",
    ),
    "diagnose": Entry(
        "rig.diagnose.command:diagnose_command", "Find, name and model the physics that C V|V| leaves out.", "diagnose"
    ),
    "settle": Entry(
        "rig.operate.settle:settle_command",
        "Run the next experiment and diagnose again until one answer stands.",
        "diagnose",
    ),
    "simulate": Entry(
        "rig.twin.simulate:simulate_command", "The run of a plan that a twin predicts, as a recording.", "diagnose"
    ),
    "compare": Entry(
        "rig.diagnose.compare:compare_command", "What a simulation leaves out relative to the real run.", "diagnose"
    ),
    "prove": Entry(
        "rig.blind.command:prove_command", "Prove the diagnosis on recordings with concealed physics.", "develop"
    ),
    "vehicle": Entry(
        "rig.vehicle.command:vehicle_command",
        "Identify drag, efficiency and inertia of a vehicle from its trials.",
        "vehicles",
    ),
    "capture": Entry("rig.captures.command:capture_command", "Write the raw bytes of a device or bus, with times."),
    "replay": Entry(
        "rig.replay.command:replay_command", "Play a recording into the console, a capture through its driver."
    ),
    "import": Entry("rig.importing.command:import_command", "Make a recording of another program's table or log."),
    "export": Entry("rig.exporting.command:export_command", "Write a recording as tables, a twin for simulators."),
    "recover": Entry(
        "rig.recording.recover:recover_command", "Copy a recording that was not closed in order into a plain file."
    ),
    "pack": Entry("rig.recording.pack:pack_command", "Packed copies of recordings for an archive."),
    "list": Entry("rig.catalogue.list_command:list_command", "Recordings, campaigns and results of a folder."),
    "show": Entry("rig.catalogue.show_command:show_command", "All that is known of one recording, campaign or result."),
    "fleet": Entry(
        "rig.fleet_report.command:fleet_command",
        "One page of a whole fleet: who left the limits, since when, and why.",
        "identify",
    ),
    "compare-fits": Entry(
        "rig.catalogue.compare_fits:compare_fits_command",
        "Has a thruster changed? Its fits in order of time.",
        group="identify",
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

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Raises UsageError for what is no command, with the nearest that is one."""
        name = args[0]
        if name not in COMMANDS and not name.startswith("-") and not ctx.resilient_parsing:
            near = difflib.get_close_matches(name, COMMANDS, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(COMMANDS)}"
            raise click.UsageError(f"there is no command {name!r}; {hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list in `rig --help`, by what a person wants to do, from the table alone."""
        del ctx
        width = max(map(len, COMMANDS))
        for group, heading in GROUPS.items():
            with formatter.section(heading):
                rows = [(name.ljust(width), entry.help) for name, entry in COMMANDS.items() if entry.group == group]
                formatter.write_dl(rows)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """What the Tab key offers, from the table alone: it shall not wait for scipy either."""
        from click.shell_completion import CompletionItem

        found = [CompletionItem(name, help=e.help) for name, e in COMMANDS.items() if name.startswith(incomplete)]
        return found + click.Command.shell_complete(self, ctx, incomplete)


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]}, epilog=FIRST)
@click.version_option(package_name="thruster-rig", prog_name="rig")
def rig() -> None:
    """Calibrate thrusters on a test rig: sequence, record, identify."""


def main(arguments: list[str] | None = None) -> int:
    """Run one command; what is the input's fault is one sentence on stderr and status 2."""
    if COMPLETING in os.environ:  # the shell reads this, as bytes
        return _main(arguments)
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
