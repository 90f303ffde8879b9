"""What a process that diagnoses says, told by `cat`: an answer of a real diagnosis, and one made of it with a rival."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

EXPLAINED: dict[str, Any] = json.loads(Path(__file__).with_name("explained.json").read_text(encoding="utf-8"))
LEVELS = (0.0, 5.4, -5.4, 16.2, -16.2, 0.0)
RIVAL = {
    "effect": "winding_resistance",
    "form": "",
    "parameters": {},
    "bic_loss": 1.2,
    "statement": "Winding resistance: the current takes 0.08 of the voltage.",
}


def ambiguous(thruster: str = "T3", flows: tuple[float, ...] = (0.0,)) -> dict[str, Any]:
    """Cannot tell a dead band from a winding resistance, and proposes a sweep."""
    (finding,) = EXPLAINED["findings"]
    steps = [{"command_voltage": V, "duration": 3.0, "flow_speed": flow} for flow in flows for V in LEVELS]
    return {
        **EXPLAINED,
        "thruster": thruster,
        "verdict": "ambiguous",
        "headline": "ambiguous",
        "statement": f"{finding['statement']} Instead of dead_band it may be winding_resistance: these recordings "
        "cannot tell which. To settle it run the next experiment.",
        "findings": [
            {
                **finding,
                "share": 0.82,
                "grade": "mostly",
                "doubts": ["its size differs between the two directions"],
                "rivals": ["winding_resistance"],
                "rival_details": [RIVAL],
            }
        ],
        "next_experiment": {
            "why": "separates dead_band from winding_resistance: levels of +-5.4, 16.2 V",
            "steps": steps,
            "expected_power": 0.97,
        },
    }


def unexplained(thruster: str = "T2") -> dict[str, Any]:
    """Nothing has a name."""
    return {
        **EXPLAINED,
        "thruster": thruster,
        "verdict": "unexplained",
        "headline": "unexplained",
        "statement": "What C V|V| leaves out has no name in the catalogue.",
        "findings": [],
        "unexplained": {
            "statement": "81 % of what remains is between 4 and 9 V of command_voltage.",
            "resembles": ["exponent (fails its shape)"],
        },
    }


def message(answer: dict[str, Any], campaign: str = "demo.toml", no_sweep: str = "") -> dict[str, Any]:
    """With what the console is told beside the answer."""
    return {"answer": answer, "campaign": campaign, "no_sweep": no_sweep}


def speaker(folder: Path, *messages: dict[str, Any], then: str = "") -> tuple[str, ...]:
    """A command that says this; `then`: Python that it runs afterwards."""
    script = folder / f"speaker-{len(list(folder.glob('speaker-*')))}.py"
    said = "".join(json.dumps(each) + "\n" for each in messages)
    script.write_text(f"import sys, time\nprint({said!r}, end='', flush=True)\n{then}\n", encoding="utf-8")
    return (sys.executable, "-S", str(script))
