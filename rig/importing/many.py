"""`rig import FILES --jobs N`: every file by itself, a recording of each, and a row that says what was understood."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rig.errors import ConfigError
from rig.fleet.asking import ask_all
from rig.fleet.elsewhere import is_url
from rig.fleet.files import meant
from rig.fleet.options import Fleet
from rig.fleet.question import Question
from rig.importing.mapping import FileMap
from rig.importing.row import COLUMNS, recording_of

ENDINGS = {
    "text": ".csv", "ulog": ".ulg", "dataflash": ".bin", "tlog": ".tlog", "mcap": ".mcap", "bag": ".bag",
    "tdms": ".tdms", "mdf": ".mf4", "mat": ".mat", "parquet": ".parquet",
}  # fmt: skip
"""Of the files that a folder stands for, by the kind that the map says."""


def import_all(question: Question, form: FileMap, names: Sequence[str], fleet: Fleet) -> int:
    """Exit status as of `ask_all`. Raises ConfigError before anything is written."""
    ending, folder = ENDINGS[form.kind], question.options["folder"]
    urls = meant(names, ending)
    if folder is None and any(map(is_url, urls)):
        raise ConfigError("--output FOLDER: where shall the recordings of files elsewhere go? Give a folder")
    _require_apart(urls, folder)
    if folder is not None:
        Path(folder).mkdir(parents=True, exist_ok=True)
    return ask_all(question, COLUMNS, urls, fleet, stands=lambda row: Path(row["recording"]).is_file())


def _require_apart(urls: Sequence[str], folder: str | None) -> None:
    taken: dict[Path, str] = {}
    for url in urls:
        other = taken.setdefault(recording_of(url, folder), url)
        if other != url:
            raise ConfigError(
                f"{other} and {url} would both become {recording_of(url, folder)}; import them into two folders"
            )
