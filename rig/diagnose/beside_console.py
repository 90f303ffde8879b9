"""`python -m rig.diagnose.beside_console FILE...`: a diagnosis for the console that started it, a line of JSON each.

`{"at": TEXT}` says how far it is; then comes `{"answer": DIAGNOSIS, "campaign": PATH, "no_sweep": TEXT}`, or
`{"fault": TEXT}`.
SIGINT ends the search with what it has, and a second one everything. It ends when its standard input does: the console
is gone.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

from rig.diagnose.command import diagnose_files
from rig.diagnose.next_plan import limits_of
from rig.diagnose.recording_names import file_names, told_by_name
from rig.errors import ConfigError, RigError
from rig.recording.ledger import read

if TYPE_CHECKING:
    from rig.campaign.config import CampaignConfig

NICER: Final = 10
"""Steps of niceness: whatever else runs on the machine goes first."""
NEWS: Final = 0.2
"""s at least between two lines on how far it is."""
ENDED_AT_ONCE: Final = 130
"""Exit status of what a second SIGINT ended."""

Say = Callable[[dict[str, Any]], None]


class Progress:
    """An observer of a diagnosis (identification.mismatch.observer) that says how far it is, and may be interrupted."""

    def __init__(self, say: Say, now: Callable[[], float] = monotonic) -> None:
        """`now` gives s."""
        self._say, self._now, self._begun = say, now, now()
        self._said = float("-inf")
        self._stage = ""
        self._asked = False

    def stage(self, name: str) -> None:
        self._stage = name
        self._tell(name)

    def trying(self, what: str) -> None:
        if self._asked:
            from identification.mismatch.observer import Interrupted

            raise Interrupted
        if self._now() - self._said >= NEWS:
            self._tell(f"{self._stage}: {what}")

    def interrupt(self, signum: int, frame: FrameType | None) -> None:
        """A handler of SIGINT. Raises SystemExit the second time, and where there is no search to end."""
        del signum, frame
        if self._asked or not self._stage:
            raise SystemExit(ENDED_AT_ONCE)
        self._asked = True

    def _tell(self, what: str) -> None:
        self._said = self._now()
        self._say({"at": f"{self._said - self._begun:.0f} s, {what}"})


def campaign_of(recording: Path) -> CampaignConfig:
    """The campaign that a recording was made with, by the ledger beside it. Raises RigError."""
    from rig.campaign.loading import load_campaign  # pydantic and every driver

    begun = next((fact for fact in read(recording.parent) if fact["fact"] == "start"), None)
    if begun is None:
        raise ConfigError(f"{recording.parent}: the ledger does not say which campaign it is of")
    return load_campaign(Path(begun["campaign_file"]))


def answer(files: Sequence[Path], say: Say, progress: Progress) -> None:
    """Diagnose the files, the last of which is the newest, within what its bench allows; say what came of it."""
    from identification.mismatch.answer.as_json import diagnosis_json

    try:
        campaign, why = campaign_of(files[-1]), ""
    except (RigError, OSError) as error:
        campaign, why = None, str(error)
    try:
        limits = None if campaign is None else limits_of(campaign)
        found = diagnose_files(files, limits=limits, observer=progress)
        told = diagnosis_json(told_by_name(found, file_names(files)))
    except (RigError, OSError) as error:
        say({"fault": str(error)})
        return
    say({"answer": told, "campaign": "" if campaign is None else str(campaign.path.resolve()), "no_sweep": why})


def end_with_input() -> None:
    """From now on this process ends as soon as standard input does."""

    def wait() -> None:
        while os.read(0, 4096):
            pass
        os._exit(ENDED_AT_ONCE)

    threading.Thread(target=wait, name="end of input", daemon=True).start()


def main(names: Sequence[str]) -> None:
    """Of the files with these names."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints is none of our lines

    def say(message: dict[str, Any]) -> None:
        out.write(json.dumps(message, allow_nan=False) + "\n")
        out.flush()

    os.nice(NICER)
    end_with_input()
    progress = Progress(say)
    signal.signal(signal.SIGINT, progress.interrupt)
    answer([Path(name) for name in names], say, progress)


if __name__ == "__main__":
    main(sys.argv[1:])
