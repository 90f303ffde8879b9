"""The page that a campaign's end writes by itself: a process of its own, which nothing of the run waits for or needs.

    python -m rig.campaign_report.at_end FOLDER

Exit status 0 when the page is there; else 1, and one line on standard error says why.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import Final

from identification.mismatch.observer import UNWATCHED
from identification.thruster.thrust_report import misfit
from rig.campaign_report import answers
from rig.campaign_report.answers import Told
from rig.campaign_report.command import REPORT_FILE, keep
from rig.campaign_report.folder import campaign_in
from rig.campaign_report.page import campaign_page
from rig.report.page import html

SEARCH: Final = 20.0
"""s for the diagnoses of all thrusters together: somebody waits for his terminal."""
NICENESS: Final = 10
"""The next campaign may begin on this machine while the page of the last is made."""
LATER = "`rig report {folder}` makes it and the rest of this page anew"
FITS = "its model fits its points, and a campaign's end waits for no more; " + LATER
NO_TIME = "there was no time for it at the campaign's end; " + LATER


def in_time(
    told: Sequence[Told], folder: str, seconds: float = SEARCH, now: Callable[[], float] = monotonic
) -> tuple[Told, ...]:
    """With the diagnosis of those whose model does not fit, while there is time; of the others the sentence why not."""
    end = now() + seconds
    out = []
    for each in told:
        if each.answer is None or not misfit(each.answer.fit):
            out.append(replace(each, why_no_diagnosis=FITS.format(folder=folder)))
        elif now() >= end:
            out.append(replace(each, why_no_diagnosis=NO_TIME.format(folder=folder)))
        else:
            out += answers.diagnosed([each], end - now(), lambda: nullcontext(UNWATCHED), _nobody_listens)
    return tuple(out)


def _nobody_listens(text: str) -> None:
    """What takes its time is told to nobody."""


def write(folder: Path) -> Path:
    """The page of the campaign in `folder`, in it. Raises RigError, OSError."""
    campaign = campaign_in(folder)
    told = answers.fitted(campaign)
    changes, faults = answers.compared(told, (), folder)
    path = folder / REPORT_FILE
    keep(path, html(campaign_page(campaign, in_time(told, folder.name), changes, faults)))
    return path


if __name__ == "__main__":
    os.nice(NICENESS)
    try:
        write(Path(sys.argv[1]))
    except Exception as error:  # noqa: BLE001 - the top of a process: the one line that its starter tells
        sys.exit(f"{type(error).__name__}: {error}")
