"""Recordings of a production, and beside them what they hide.

    python benchmarks/fleet/make.py FOLDER [--units 2000] [--seed 0] [--sound] [--short]

`--short`: eight levels instead of eighteen. FOLDER/truth.json is not read by any command of the rig.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from benchmarks.fleet.production import LEVELS, SHORT, production, write


def main() -> None:
    known = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    known.add_argument("folder", type=Path)
    known.add_argument("--units", type=int, default=2000)
    known.add_argument("--seed", type=int, default=0)
    known.add_argument("--sound", action="store_true")
    known.add_argument("--short", action="store_true")
    asked = known.parse_args()
    made, begun = production(asked.units, asked.seed, sound=asked.sound), time.monotonic()
    asked.folder.mkdir(parents=True, exist_ok=True)
    for unit in made.units:
        write(unit, asked.folder / f"T200-{unit.number:05}.h5", SHORT if asked.short else LEVELS)
    truth = {"odd": {f"T200-{k:05}": name for k, name in made.odd.items()}, "batch": made.batch}
    (asked.folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    size = sum(path.stat().st_size for path in asked.folder.glob("*.h5"))
    print(f"{asked.units} recordings, {size / 1e6:.0f} MB, in {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    main()
