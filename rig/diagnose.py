"""`rig diagnose FILE...`: what the model leaves out of these recordings, located, named, refitted and judged."""

from __future__ import annotations

import json
from collections.abc import Iterable
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.errors import RecordingError, RigError

if TYPE_CHECKING:  # numpy and scipy come up when a diagnosis is made, not for `rig diagnose --help`
    from identification.mismatch.diagnosis import Diagnosis
    from identification.recording import Recording

WHAT = "expected one or more recordings (*.h5) of one thruster"


def recordings_in(paths: Iterable[Path], who: str = "rig diagnose") -> list[Path]:
    """The files meant by files and folders; a folder stands for its *.h5. Raises RecordingError."""
    found = list(chain.from_iterable(_in(Path(path)) for path in paths))
    if not found:
        raise RecordingError(f"{who}: no recording was given; {WHAT}")
    return found


def _in(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(path.glob("*.h5"))
    if not found:
        raise RecordingError(f"{path} is a folder without recordings; {WHAT}")
    return found


def read(paths: Iterable[Path]) -> list[Recording]:
    """Raises RecordingError with one sentence for the first that cannot be read."""
    from rig.hdf5 import load

    return [load(path) for path in paths]


def diagnose_files(paths: Iterable[Path], holdout: Iterable[Path] = (), seed: int = 0) -> Diagnosis:
    """The diagnosis of recordings of one thruster. Raises RecordingError for what cannot be diagnosed."""
    from identification.mismatch.diagnose import diagnose
    from identification.mismatch.preparing import Refusal

    found = diagnose(read(recordings_in(paths)), read(holdout), seed)
    if isinstance(found, Refusal):
        raise RecordingError(found.reason)
    return found


def tell(found: Diagnosis, json_path: Path | None, report: Path | None) -> None:
    """The page and the JSON where they are wanted; text for a person unless the JSON goes to standard output."""
    from identification.mismatch.diagnosis import diagnosis_json
    from rig.diagnose_text import diagnosis_text

    if report is not None:
        import_module("rig.report.diagnosis").write(found, report)  # matplotlib: only where a page is drawn
    if json_path is not None:
        text = json.dumps(diagnosis_json(found), indent=1, allow_nan=False)
        if str(json_path) == "-":
            click.echo(text)
            return
        json_path.write_text(text + "\n", encoding="utf-8")
    click.echo(diagnosis_text(found))


PATH = click.Path(path_type=Path)


@click.command("diagnose")
@click.argument("files", nargs=-1, required=True, type=PATH)
@click.option(
    "--holdout", type=PATH, multiple=True, help="Recording that is not fitted, only predicted (may be repeated)."
)
@click.option("--json", "json_path", type=PATH, help="Write the diagnosis here; - is standard output.")
@click.option(
    "--report", type=click.Path(dir_okay=False, path_type=Path), help="Write a page with figures here (HTML)."
)
@click.option("--seed", default=0, show_default=True, help="Of the surrogates that the false-alarm rate is judged by.")
def diagnose_command(
    files: tuple[Path, ...], holdout: tuple[Path, ...], json_path: Path | None, report: Path | None, seed: int
) -> None:
    """Find the physics that C V|V| leaves out of recordings of one thruster; a folder stands for its *.h5.

    Exit status 0 for every honest verdict, 2 for input that cannot be used (one sentence why).
    """
    try:
        held = recordings_in(holdout) if holdout else []
        tell(diagnose_files(files, held, seed), json_path, report)
    except (RigError, OSError) as error:
        click.echo(f"rig diagnose: {error}", err=True)
        raise SystemExit(2) from error
