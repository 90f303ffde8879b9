"""`python -m tests.rig.console.seated OUT`: a console in this terminal, its feed played; OUT says what came of it."""

from __future__ import annotations

import sys
from pathlib import Path

from rig.console import attend
from tests.rig.console.feeds import PlayedFeed, running

if __name__ == "__main__":
    feed = PlayedFeed(running())
    sitting = attend(feed)
    Path(sys.argv[1]).write_text(f"{sitting.status} {feed.closed} {' '.join(feed.kinds())}".strip())
    sys.exit(sitting.status)
