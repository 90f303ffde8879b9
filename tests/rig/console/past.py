"""What the catalogue of a year says: rows as `rig.catalogue.beside_console` has them, and a comparison."""

from __future__ import annotations

import json
import sys
from typing import Any, Final

PAST = (
    ("campaign", "autumn-2/campaign.jsonl", "2026-11-21 15:02", "", "autumn", "completed", "", "",
     "2 of 2 thrusters measured: T1, T2"),
    ("recording", "autumn-2/T2.h5", "2026-11-21 15:06", "T2", "autumn", "completed", "0.38693 ± 0.00046", "fits", ""),
    ("recording", "autumn-2/T1.h5", "2026-11-21 15:02", "T1", "autumn", "completed", "0.40193 ± 0.00047", "explained",
     ""),
    ("campaign", "summer-1/campaign.jsonl", "2026-06-15 08:40", "", "summer", "tripped", "", "",
     "0 of 2 thrusters measured: T1, T2. motor.current 41.2 A is above its limit of 40 A"),
    ("recording", "summer-1/T1.h5", "2026-06-15 08:40", "T1", "summer", "tripped", "", "", ""),
    ("recording", "loose/T7.h5", "2026-04-02 11:20", "T7", "", "completed", "0.2970 ± 0.0013",
     "does NOT fit, 153", ""),
    ("fit", "old/fits-2025.json", "2026-03-09 10:01", "T1", "", "", "0.39860 ± 0.00040", "fits", ""),
    ("campaign", "spring-1/campaign.jsonl", "2026-03-02 09:12", "", "spring", "completed", "", "",
     "1 of 1 thrusters measured: T1"),
    ("recording", "spring-1/T1.h5", "2026-03-02 09:12", "T1", "spring", "completed", "0.39862 ± 0.00041", "adequate",
     ""),
)  # fmt: skip
COMPARED: dict[str, Any] = {
    "changed": True,
    "sentence": "T1 has changed since fit 1 (2026-03-02 09:12): C of fit 2 is 3.014 +- 0.032 % smaller than that of "
    "fit 1 (k = 2); 1 of 1 differ at 5 %",
    "fits": [
        {"began": began, "source": source, "parameters": {"C": {"value": C, "expanded_k2": U, "unit": "N/V^2"}}}
        for began, source, C, U in (
            ("2026-03-02T09:12:00Z", "spring-1/T1.h5", 0.39862, 0.00041),
            ("2026-11-21T15:02:00Z", "autumn-2/T1.h5", 0.38660, 0.00040),
        )
    ],
    "pairs": [
        {
            "coefficient": "C",
            "relative": -0.03014,
            "relative_interval_95": [-0.03047, -0.02981],
            "p_adjusted": 1e-13,
            "changed": True,
        }
    ],
    "notes": ["same cell, same calibration: its gain error cancels in the difference"],
}


def past_rows() -> list[dict[str, Any]]:
    """Newest first."""
    names = ("what", "path", "date", "thruster", "campaign", "outcome", "C", "verdict", "said")
    more = {"id": "", "began": None, "reason": ""}
    return [dict(zip(names, row, strict=True)) | more for row in PAST]


def _said(*messages: dict[str, Any]) -> str:
    return "\n".join(json.dumps(each) for each in messages)


LISTED, ANSWERED = _said({"rows": past_rows()}, {"end": "5 recordings"}), _said({"compared": COMPARED})
CODE = f"import sys\nprint({ANSWERED!r} if 'compare' in sys.stdin.readline() else {LISTED!r})"
TELLS_PAST: Final = (sys.executable, "-S", "-c", CODE)
"""A command that answers as the catalogue does."""
