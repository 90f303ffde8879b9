"""Draws the worked example of section 4.2.3: the thesis's figures 4.6 and 4.7, as a page and as two SVG files.

    python examples/thesis_velocity.py [FOLDER]

FOLDER is where they go; default: `recordings/thesis` in the project.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from rig.report.page import write
from rig.vehicle.report.velocity import velocity_example, velocity_page

HERE = Path(__file__).resolve().parents[1] / "recordings" / "thesis"
SEED = 4


def main(folder: Path) -> None:
    page = velocity_page(np.random.default_rng(SEED))
    write(page, folder / "velocity.html")
    print(page.lead)
    for path in (folder / "velocity.html", *velocity_example(np.random.default_rng(SEED), folder)):
        print(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
