"""What dialogs have drawn is let go with them: an operator may open a hundred in a day."""

import asyncio
import gc

from textual._styles_cache import StylesCache

from tests.rig.console.sitting import sitting
from tests.rig.console.test_stop import running

OPENINGS = 6


def kept() -> int:
    gc.collect()
    return sum(type(each) is StylesCache for each in gc.get_objects())


def test_nothing_is_kept_of_dialogs_that_have_closed():
    async def scene():
        async with sitting(running(), size=(160, 48)) as desk:
            counts = []
            for _ in range(OPENINGS):
                await desk.press("n")
                await desk.press("escape")
                counts.append(kept())
            return counts

    counts = asyncio.run(scene())
    since = OPENINGS - 2
    assert counts[-1] - counts[1] < since, "one or two come and go with what is drawn meanwhile; a dialog has ten"
