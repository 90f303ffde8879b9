"""Cases on disc: recordings that anybody may open, and beside them, in a folder of its own, the sealed truth.

    OUT/open/<token>/0.npz, 1.npz ...   one recording each: `about` (JSON text), `time0`, `value0`, `time1` ...
    OUT/open/<token>/again/0.npz        the same thruster a second time, where that is asked for
    OUT/open/<token>/drive.npz          another run without its thrust, for a prediction at the times `at`; in `again`
                                        where there is a second recording, of whose thruster it is
    OUT/sealed/<token>.json             what was concealed; `error` where no such case could be drawn
    OUT/sealed/<token>.npz              `thrust` and `measured` of that other run at the times `at`

A case is asked for by a table: `token` (its name, which should tell nothing), `seed` (integers), and what is not to be
left to chance: `effects`, `strength`, `forms`, `noise`, `plan`, `lie`, `runs`, `sampling`, `duration`, `wiring` as of
`concealed.case`; `rivals`: names whose likeness to the first effect goes into the seal (`concealed.twins`), of a second
recording to what came on top, and the known amounts beside them (`concealed.visibility.learned`);
`world`: the version that is to make it, where that matters.

With `field`, a list of effects in the place of `effects`, their amounts are drawn as the field has them
(`composites.composite`); with `more` as well the thruster is recorded a second time, `more` concealed beside them at
`strength`, or nothing where it is empty, or with another amount of the effect `changed`. The seal is then that of the
second run: `known` are the effects of both, as they were; `first` is the truth of the first.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.cases.definition import Case
from sim_devices.concealed.cases.faults import KINDS as LIES
from sim_devices.concealed.cases.field_size import FIELD
from sim_devices.concealed.cases.forms import FORMS, VARIANTS
from sim_devices.concealed.cases.shapes import SHAPES
from sim_devices.concealed.cases.wide_noise import WIDE_NOISE_KINDS
from sim_devices.concealed.cases.wiring import KINDS as WIRINGS
from sim_devices.concealed.cases.wiring import NOTHING as WIRED_RIGHT
from sim_devices.concealed.composites import ADDED, composite, difference
from sim_devices.concealed.draw import NOISE_KINDS
from sim_devices.concealed.draw import case as drawn
from sim_devices.concealed.sealing.another import another
from sim_devices.concealed.sealing.records import Rows, rows, truth
from sim_devices.concealed.version import version
from sim_devices.concealed.visibility.learned import beside_first
from sim_devices.concealed.visibility.oracle import OutOfReach
from sim_devices.concealed.visibility.rivals import Twin, twins
from sim_devices.tables import WorldError

Floats = NDArray[np.float64]

KINDS: Mapping[str, Any] = {
    "effects": list(SHAPES),
    "forms": {effect: list(forms) for effect, forms in FORMS.items()},
    "variants": {effect: list(forms) for effect, forms in VARIANTS.items()},
    "lies": list(LIES),
    "noise": list(NOISE_KINDS),
    "wide_noise": list(WIDE_NOISE_KINDS),
    "field": list(FIELD),
    "added": list(ADDED),
    "wiring": [WIRED_RIGHT, *WIRINGS],
    "version": version(),
}
"""What may be asked for, and of what world."""
CHOSEN = ("effects", "strength", "forms", "noise", "plan", "lie", "runs", "sampling", "duration", "wiring")
CHOSEN_OF_COMPOSITES = ("noise", "plan", "sampling", "duration")
KNOWN = frozenset({"token", "seed", "world", "rivals", "field", "more", "changed", *CHOSEN})
KNOWN_AMOUNTS = "amounts of the known"
"""Rival of what came on top in a second recording: other amounts of what the first one has."""
NEAREST = 5
"""Twins that go into the seal."""
AGAIN = "again"
"""Folder of the second recording."""


def conceal(asked: Mapping[str, Any], out: Path) -> None:
    """Make one case. A folder that is there is written anew. Raises WorldError for a table that cannot be read."""
    unknown = sorted(set(asked) - KNOWN)
    if unknown or not {"token", "seed"} <= set(asked):
        raise WorldError(f"case: expected token, seed and some of {', '.join(sorted(KNOWN))}; got {sorted(asked)}")
    if asked.get("world") not in (None, "", KINDS["version"]):
        raise WorldError(f"case: this is world {KINDS['version']}, asked was {asked['world']}")
    token, seed = str(asked["token"]), list(asked["seed"])
    sealed = out / "sealed"
    sealed.mkdir(parents=True, exist_ok=True)
    try:
        case, second = _cases(asked, np.random.default_rng(seed))
    except OutOfReach as error:
        write_json(sealed / f"{token}.json", {"asked": dict(asked), "error": str(error)})
        return
    except (TypeError, ValueError) as error:
        raise WorldError(f"case {token}: {error}") from error
    folder, first = out / "open" / token, None
    told = _recorded(case, folder)
    if second is not None:
        folder = folder / AGAIN
        known = [c.effect for c in case.effects if c.effect != asked.get("changed")]
        told, first, case = _recorded(second, folder) | {"known": known, "first": told}, case, second
    told |= {"asked": dict(asked), "thruster": asdict(case.thruster), "error": None}
    if asked.get("rivals") and case.effects:
        told["twins"] = nearest(case, str(asked.get("more") or case.effects[0].effect), asked, first)
    if case.fault is None and "wiring" not in asked:
        other = another(case, np.random.default_rng([*seed, 2]))
        write_rows(folder / "drive.npz", other.drive, at=other.at)
        exact, seen = other.thrust.astype(np.float32), other.measured.astype(np.float32)
        np.savez_compressed(sealed / f"{token}.npz", thrust=exact, measured=seen)
    write_json(sealed / f"{token}.json", told)  # last: a seal stands for a case that is complete


def nearest(case: Case, effect: str, asked: Mapping[str, Any], first: Case | None = None) -> list[dict[str, Any]]:
    """For the seal, nearest first: what the asked rivals would leave of `effect`; where it came on top of what `first`
    conceals, that is the nearest which the amounts of all before leave."""
    rng = np.random.default_rng([*asked["seed"], 1])
    found = twins(case, effect, list(asked["rivals"]), rng)
    if first is not None:
        found.append(Twin(KNOWN_AMOUNTS, "", beside_first(first, case, effect)))
    return [asdict(twin) for twin in sorted(found, key=lambda twin: twin.left)[:NEAREST]]


def _cases(asked: Mapping[str, Any], rng: np.random.Generator) -> tuple[Case, Case | None]:
    """What is recorded first, and a second time. Raises OutOfReach; TypeError and ValueError for what cannot be."""
    if "field" not in asked:
        if "more" in asked:
            raise ValueError("more: expected `field` with it, the effects of the first recording; give both")
        return drawn(rng, **{name: asked[name] for name in CHOSEN if name in asked}), None
    not_taken = set(CHOSEN) if asked.get("more") else {"rivals", *CHOSEN}
    if instead := sorted(set(asked) & not_taken - {"strength", *CHOSEN_OF_COMPOSITES}):
        raise ValueError(f"field: its effects are all there is, got {', '.join(instead)} with it; leave that out")
    chosen = {name: asked[name] for name in CHOSEN_OF_COMPOSITES if name in asked}
    if "more" not in asked:
        return composite(rng, asked["field"], **chosen), None
    strength = {"strength": asked["strength"]} if "strength" in asked else {}
    changed = str(asked.get("changed", ""))
    both = difference(rng, asked["field"], asked["more"], **strength, **chosen, changed=changed)
    return both.first, both.second


def _recorded(case: Case, folder: Path) -> dict[str, Any]:
    """The recordings of a case in `folder`, and what is true of them."""
    folder.mkdir(parents=True, exist_ok=True)
    for i, found in enumerate(rows(case)):
        write_rows(folder / f"{i}.npz", found)
    return truth(case)


def write_rows(path: Path, found: Rows, at: Floats | None = None) -> None:
    """One recording as an npz file; `at`: the times at which a prediction is wanted."""
    about = {
        "recording_id": found.recording_id,
        "thruster": found.thruster,
        "columns": [
            {"stream": c.stream, "name": c.name, "quantity": c.quantity, "unit": c.unit, "thruster": c.thruster}
            for c in found.columns
        ],
        "steps": [asdict(step) for step in found.steps],
        "duration": found.duration,
    }
    arrays: dict[str, Any] = {"about": np.array(json.dumps(about))}
    for i, column in enumerate(found.columns):
        arrays |= {f"time{i}": column.time, f"value{i}": column.value}
    np.savez(path, **(arrays if at is None else arrays | {"at": at}))


def write_json(path: Path, table: Mapping[str, Any]) -> None:
    """Whole or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    part.replace(path)
