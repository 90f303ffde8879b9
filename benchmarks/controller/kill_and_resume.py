"""A campaign of 100 steps and three thrusters, killed at random moments and resumed: the same steps and results?

    python benchmarks/controller/kill_and_resume.py [KILLS [SEED]]

In virtual time, with the controller's own code and files: kill -9 takes controller and recorder at one instant, so that
no file is closed. Beside it the same campaign, left alone.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.rig.operate.kill_and_resume import campaign, told

MOST = 11.0
"""s of a part until its kill; some 4 s of it are preflight, proof and tare."""
SIGMAS = 4.0


def main(kills: int, seed: int) -> int:
    """0 when every step was measured once and every C is the same within its error."""
    with tempfile.TemporaryDirectory() as folder:
        whole = campaign(Path(folder) / "whole", 0, seed, MOST, long=True)
        cut = campaign(Path(folder) / "cut", kills, seed, MOST, long=True)
    print(f"left alone: {told(whole)}")
    print(f"killed:     {told(cut)}")
    same = cut.results == whole.results and cut.ended[-1] == "completed"
    apart = [
        abs(cut.C[name][0] - value) / (cut.C[name][1] ** 2 + std**2) ** 0.5 for name, (value, std) in whole.C.items()
    ]
    print(f"attempts: {' '.join(map(str, cut.attempts))}")
    print(f"the same steps, each once: {same}; C apart by at most {max(apart):.1f} standard errors")
    return 0 if same and max(apart) < SIGMAS else 1


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    sys.exit(main(*(numbers + [50, 1][len(numbers) :])))
