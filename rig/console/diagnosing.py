"""`rig diagnose` beside the console, once nothing turns: its processor time would be the control loop's."""

from __future__ import annotations

import asyncio
import sys
from asyncio.subprocess import PIPE, STDOUT
from collections.abc import AsyncIterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from rich.text import Text

from rig.console.panels import Panel
from rig.visible_text import visible

DIAGNOSE: Final = (sys.executable, "-c", "from rig.cli import entry; entry()", "diagnose")
"""The command to which a recording is added."""
NOT_YET: Final = "Once the campaign has ended, g diagnoses its recordings: what physics C V|V| leaves out."


class DiagnosisPanel(Panel):
    """What was said so far, in the words of `rig diagnose`."""

    def on_mount(self) -> None:
        self.tell([], "")

    def tell(self, said: Sequence[str], doing: str) -> None:
        text = Text("\n\n".join([*said, *([doing] if doing else [])]) or NOT_YET)
        self.put(text.plain, text)


async def answers(files: Sequence[str], command: Sequence[str] = DIAGNOSE) -> AsyncIterator[str]:
    """Of each recording in turn. Who stops listening ends the process that is under way."""
    for file in files:
        process = await asyncio.create_subprocess_exec(*command, file, stdin=PIPE, stdout=PIPE, stderr=STDOUT)
        try:
            out, _ = await process.communicate()
        finally:
            with suppress(ProcessLookupError):  # it has ended
                process.kill()
        yield f"{Path(file).name}\n{visible(out.decode(errors='replace').strip())}"
