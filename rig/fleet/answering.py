"""The process of a local engine: `python -m rig.fleet.answering QUESTION`, both and all that follows as JSON.

One line in, {"url"}, one line out: the row, or {"failed"}, the sentence why the file was not to be had or not read.
What else is printed goes to standard error: the way out is for rows alone.
"""

from __future__ import annotations

import json
import os
import sys
from typing import TextIO

from rig.errors import UnreadError
from rig.fleet.one import one
from rig.fleet.question import Question
from rig.workers.called import called


def main(text: str, lines: TextIO, out: TextIO) -> None:
    """Until the input ends."""
    question = Question(**json.loads(text))
    called(question.place)  # now, and not with the first file
    for line in iter(lines.readline, ""):
        url = json.loads(line)["url"]
        try:
            found = one(url, question)
        except UnreadError as error:
            found = {"failed": str(error)}
        except OSError as error:
            found = {"failed": f"{url} can't be read: {error.strerror or error}"}
        out.write(json.dumps(found, allow_nan=False) + "\n")
        out.flush()


if __name__ == "__main__":
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as answers:
        os.dup2(2, 1)
        main(sys.argv[1], sys.stdin, answers)
