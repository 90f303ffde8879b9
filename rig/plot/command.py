"""`rig plot RECORDING... -o FIG`: one figure of recordings of one thruster, as PNG, SVG or PDF."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.errors import ConfigError, RecordingError, RigError
from rig.list_option import ListCommand, ListOption
from rig.result_path import RESULT_FILE

if TYPE_CHECKING:
    from identification.recording import Recording
    from rig.report.style import Plot

PATH = click.Path(path_type=Path)
WHOLE = ("thrust", "residuals", "timeseries")
"""What `--what` takes besides names of channels; each is a figure of its own."""


@click.command("plot", cls=ListCommand)
@click.argument("recordings", nargs=-1, required=True, type=PATH)
@click.option(
    "--what",
    cls=ListOption,
    multiple=True,
    default=("thrust",),
    metavar="thrust|residuals|timeseries|CHANNEL...",
    help="Thrust with its fit, its residuals, the usual channels over time, or the channels named.  [default: thrust]",
)
@click.option("-o", "--output", required=True, type=RESULT_FILE, help="File to write: .png, .svg or .pdf.")
def plot_command(recordings: tuple[Path, ...], what: tuple[str, ...], output: Path) -> None:
    """Draw one figure of recordings of one thruster; a folder stands for its *.h5.

    A channel is named `stream.channel`, by its name alone, or by its quantity; several stand above one another.
    """
    from rig.report.image_files import image, require_ending  # matplotlib takes a second to come up

    try:
        require_ending("-o", output)
        drawn = image(plotted(recordings, what), output.suffix.lower())
        output.write_bytes(drawn)
    except (RigError, OSError) as error:
        click.echo(f"rig plot: {error}", err=True)
        raise SystemExit(2) from error


def plotted(paths: Sequence[Path], what: Sequence[str]) -> Plot:
    """The figure that is asked for. Raises RecordingError, ConfigError."""
    from rig.fit.answer import expand
    from rig.hdf5 import load
    from rig.plot.series import named, over_time, shown

    whole = [name for name in what if name in WHOLE]
    if whole and len(what) > 1:
        raise ConfigError(f"--what {whole[0]} is a figure of its own; ask for {', '.join(what)} one after the other")
    recordings = [load(path) for path in expand(paths)]
    thrusters = list(dict.fromkeys(recording.thruster for recording in recordings))
    if len(thrusters) > 1:
        raise RecordingError(
            f"one figure is of one thruster, and these are of {', '.join(thrusters)}; give one at once"
        )
    if whole and whole[0] in FITTED:
        return FITTED[whole[0]](recordings)
    return over_time(shown(recordings) if whole else [named(name, recordings) for name in what])


def _thrust(recordings: Sequence[Recording]) -> Plot:
    from rig.fit.answer import fit_recordings
    from rig.fit.report.pictures import measured_and_fitted

    (answer,) = fit_recordings(recordings)
    return measured_and_fitted(answer.fit).plot


def _residuals(recordings: Sequence[Recording]) -> Plot:
    from rig.fit.answer import fit_recordings
    from rig.fit.report.pictures import residuals_by_level

    (answer,) = fit_recordings(recordings)
    return residuals_by_level(answer.fit).plot


FITTED: Mapping[str, Callable[[Sequence[Recording]], Plot]] = {"thrust": _thrust, "residuals": _residuals}
