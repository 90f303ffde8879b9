"""The load cell with dead weights, by hand: what is on the screen is hung, once not."""

from __future__ import annotations

import re

from benchmarks.operating.at_keys import DayError, Operator
from benchmarks.operating.place import Place

LOADS = """
[calibration]
certificate = "A-2026-117"
operator = "M. Keys"

[place]
latitude = 44.4            # degrees

[weights.pieces]           # kg
5kg = { mass = 5.0, expanded = 0.00008 }
10kg = { mass = 10.0, expanded = 0.00016 }

[steps]
ladder = [[], ["5kg"], ["10kg"], ["10kg", "5kg"]]
repetitions = 2
settle = 2.0               # s
hold = 2.0                 # s
"""
WRONG_AT, WRONG = 10, "98.042"
"""Nothing should hang at that step, but the 10 kg of another one do."""


def calibrate(here: Operator, place: Place) -> None:
    """`rig calibrate`: all steps of the plan, one of them with another weight than is said, which is told."""
    (place.folder / "loads.toml").write_text(LOADS, encoding="utf-8")
    command = "rig calibrate bench.toml --loads loads.toml"
    screen = here.types(f"clear; {command}; echo status=$?", "what to hang first", r"\b0 of \d+ steps", "Hang")
    steps = int(re.findall(r"0 of (\d+) steps", screen)[0])
    for done in range(steps):
        screen = here.sees(f"step {done + 1}", rf"\b{done} of {steps} steps", r"(Hang|Take) .*then Enter", within=60.0)
        asked = re.findall(r"(?:Hang|Take) .*?\((-?[\d.]+) N\)", screen)
        if not asked:
            raise DayError(f"the screen does not say what to hang:\n{screen}")
        if done + 1 == WRONG_AT:
            place.tell("hang", WRONG)
            here.presses("Enter", "it is doubted", "but the reading says", "probably it was 10kg", within=60.0)
            place.tell("hang", asked[0])
            here.presses("r", "hung again", rf"\b{done} of {steps} steps", r"(Hang|Take) .*then Enter")
        else:
            place.tell("hang", asked[0])
        here.window.press("Enter")
    here.sees("gain, budget, files", "gain", "written|calibration.*json", within=60.0)
    here.presses("q", "what was written", r"(?m)^status=0", "gain", within=30.0)
    text = (place.folder / "bench.toml").read_text(encoding="utf-8")
    if 'file = "load_cell-calibration-' not in text:
        raise DayError(f"the bench file does not name the calibration:\n{text}")
    here.transcript.fact("bench.toml names the calibration that was written")
