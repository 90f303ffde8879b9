"""`rig report CAMPAIGN`: one page of a whole campaign, and the same on paper; a campaign's end writes it by itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from rig.errors import LinkError, RigError
from rig.link.live_runs import live_runs
from rig.list_option import ListCommand, ListOption
from rig.result_path import RESULT_FILE, require_different

if TYPE_CHECKING:
    from rig.campaign_report.answers import Told

PATH = click.Path(path_type=Path)
REPORT_FILE: Final = "report.html"
"""In the campaign's folder, unless -o says otherwise."""
SEARCH: Final = 120.0
"""s that the search of each thruster's diagnosis has by default."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is to be on the page."""

    seconds: float | None = SEARCH
    """Of each thruster's diagnosis; None: no diagnosis."""
    why_none: str = "it was left out (--no-diagnosis)"
    earlier: tuple[Path, ...] = ()


@click.command("report", cls=ListCommand)
@click.argument("campaign", type=PATH)
@click.option("-o", "--output", type=RESULT_FILE, help=f"Page to write.  [default: {REPORT_FILE} in the folder]")
@click.option("--pdf", type=RESULT_FILE, help="Write the same page as PDF here; needs the extra thruster-rig[pdf].")
@click.option(
    "--diagnosis/--no-diagnosis", default=True, show_default=True, help="Diagnose each thruster: seconds to a minute."
)
@click.option(
    "--diagnosis-time",
    type=click.FloatRange(min=1),
    default=SEARCH,
    show_default=True,
    metavar="S",
    help="Each thruster's search ends after so long with what it has, and the page says so.",
)
@click.option(
    "--earlier",
    cls=ListOption,
    type=PATH,
    multiple=True,
    metavar="FOLDER...",
    help="Campaigns to compare with, instead of those in the same output folder.",
)
def report_command(
    campaign: Path,
    output: Path | None,
    pdf: Path | None,
    diagnosis: bool,
    diagnosis_time: float,
    earlier: tuple[Path, ...],
) -> None:
    """Tell all of CAMPAIGN, the folder that `rig run` made, on one page that can be kept, printed and signed.

    Also of a campaign that was aborted, or whose recordings are damaged in part: it says what ended it and what lacks.
    """
    from rig.campaign_report.pdf import require_pdf, write_pdf

    require_different(("-o", output), ("--pdf", pdf))
    if pdf is not None:
        require_pdf("--pdf")
    folder = campaign.resolve()
    refuse_running(folder)
    wanted = Wanted(diagnosis_time if diagnosis else None, earlier=earlier)
    text = page_text(folder, wanted, partial(click.echo, err=True))
    path = output if output is not None else folder / REPORT_FILE
    try:
        keep(path, text)
        click.echo(f"report: {path}")
        if pdf is not None:
            write_pdf(text, pdf)
            click.echo(f"as PDF: {pdf}")
    except OSError as error:
        raise RigError(f"the report can't be written: {error}") from error


def refuse_running(folder: Path) -> None:
    """Raises LinkError while a controller is on that campaign: a page takes a processor that its loop needs."""
    if any(Path(run.folder) == folder for run in live_runs()):
        raise LinkError(
            f"the run in {folder} is still going on; its report is written when it has ended, or look at it with "
            f"`rig console {folder}`"
        )


def page_text(folder: Path, wanted: Wanted, say: Callable[[str], None]) -> str:
    """The page of the campaign in `folder` as HTML. Raises RigError. `say`: told what takes its time."""
    from rig.campaign_report import answers
    from rig.campaign_report.folder import campaign_in
    from rig.campaign_report.page import campaign_page
    from rig.diagnose.progress import observed
    from rig.report.page import html

    campaign = campaign_in(folder)
    told = answers.fitted(campaign)
    changes, faults = answers.compared(told, wanted.earlier, folder)
    if wanted.seconds is not None:
        told = answers.diagnosed(told, wanted.seconds, partial(observed, shown=True), say)
    else:
        told = _undiagnosed(told, wanted.why_none)
    return html(campaign_page(campaign, told, changes, faults))


def _undiagnosed(told: Sequence[Told], why: str) -> tuple[Told, ...]:
    return tuple(replace(each, why_no_diagnosis=why) for each in told)


def keep(path: Path, text: str) -> None:
    """To a file, whole or not at all: a page that was there stays until the new one is complete. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.draft")
    draft.write_text(text, encoding="utf-8", newline="\n")
    draft.replace(path)
