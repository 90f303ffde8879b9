"""`one(url, question) -> Row`: all that a fleet does to a file, wherever it runs. It knows no engine."""

from __future__ import annotations

import json
import re
from pathlib import Path

from rig.errors import RigError, UnreadError
from rig.fleet.files import at_hand, sha256_of
from rig.fleet.question import Question, Row, software
from rig.workers.called import called


def one(url: str, question: Question) -> Row:
    """The answer for the file at `url` as a row: a function of its bytes, the question's options and the program.

    A file that can't be used has a row too, whose `error` is the sentence why. Where nothing is known of what is in it
    there is none: raises OSError if the file is not to be had, UnreadError if its reading was ended, and MemoryError.
    """
    with at_hand(url) as path:
        row: Row = {"url": url, "sha256": sha256_of(path), "error": None}
        row |= _answered(path, url, question)
    row |= {"software": software(question), "asked": question.asked}
    row["options"] = json.dumps(dict(question.options), sort_keys=True)
    return row | {"serial": serial_of(row.get("thruster"))}


def _answered(path: Path, url: str, question: Question) -> Row:
    try:
        found: Row = called(question.place)(path, question.options)
    except UnreadError as error:
        raise UnreadError(_of(url, path, error)) from None
    except RigError as error:
        return {"error": _of(url, path, error)}
    except (OSError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001  # one file of ten thousand shall not end the others: it is named
        return {"error": f"{url}: this program is at fault: {type(error).__name__}: {error}"}
    return found


def _of(url: str, path: Path, error: RigError) -> str:
    return str(error).replace(str(path), url)


def serial_of(thruster: str | None) -> int | None:
    """The last number in a thruster's name, by which a fleet is in order; None where it has none.

    >>> serial_of("T200-00417b"), serial_of("bow"), serial_of("")
    (417, None, None)
    """
    found = re.search(r"(\d{1,18})\D*$", thruster or "")
    return int(found[1]) if found else None
