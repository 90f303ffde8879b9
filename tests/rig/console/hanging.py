"""`python -m tests.rig.console.hanging SOCKET`: a console whose screen hangs as soon as it has drawn once."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from rig.console.app import ConsoleApp
from rig.console.feed import SocketFeed
from rig.console.session import attend
from rig.link.sockets import connect


def hang(app: ConsoleApp) -> None:
    """For ever: the event loop comes to nothing else."""
    if app.state.snapshot is not None:
        os.write(1, b"it hangs now")  # past Textual, which has the standard output
        while True:
            time.sleep(1.0)


if __name__ == "__main__":
    ConsoleApp.show_plots = hang
    attend(SocketFeed(connect(Path(sys.argv[1]), "the controller")))
