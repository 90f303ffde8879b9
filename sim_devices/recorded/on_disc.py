"""Recorded cases on disc, laid as by `sim_devices.concealed.sealing.on_disc`: `open/<token>/0.h5` is the recording.

A case is asked for by a table: `token`, `seed`, `bench` (of BENCHES), and what is not to be left to chance: `effects`,
`strength`, `plan`, `duration`; `world`: the version that is to make it, where that matters; `rivals`: names whose
likeness to the first effect goes into the seal (`concealed.twins`, beside the run as it was recorded).
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import asdict, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from sim_devices.concealed.cases.definition import Case
from sim_devices.concealed.sealing.another import another
from sim_devices.concealed.sealing.on_disc import nearest, write_json, write_rows
from sim_devices.concealed.sealing.records import truth
from sim_devices.concealed.visibility.oracle import OutOfReach, measured
from sim_devices.recorded.benches import BENCHES
from sim_devices.recorded.draw import EFFECTS, Drawn, drawn
from sim_devices.recorded.run import Record, run
from sim_devices.tables import WorldError

CHOSEN = ("effects", "strength", "plan", "duration")
KNOWN = frozenset({"token", "seed", "world", "bench", "rivals", *CHOSEN})


def version() -> str:
    """Changes with every change of the simulated side: all of it makes a recorded case.

    What the rig writes is its own business: drivers, control loop and writer are under test here.
    """
    root = Path(__file__).parents[1]
    found = sha256()
    for path in sorted(root.rglob("*.py")):
        found.update(path.relative_to(root).as_posix().encode())
        found.update(path.read_bytes())
    return found.hexdigest()[:12]


KINDS: Mapping[str, Any] = {"benches": list(BENCHES), "recorded_effects": list(EFFECTS), "recorded_version": version()}
"""What may be asked for, and of what world."""


def conceal(asked: Mapping[str, Any], out: Path, record: Record) -> None:
    """Make one case. Raises WorldError for a table that cannot be read.

    A case that can't be drawn, or whose run did not come to its end, has an `error` in its seal.
    """
    unknown = sorted(set(asked) - KNOWN)
    if unknown or not {"token", "seed", "bench"} <= set(asked):
        raise WorldError(f"case: expected token, seed, bench and some of {', '.join(CHOSEN)}; got {sorted(asked)}")
    if asked.get("world") not in (None, "", KINDS["recorded_version"]):
        raise WorldError(f"case: this is world {KINDS['recorded_version']}, asked was {asked['world']}")
    token, seed = str(asked["token"]), list(asked["seed"])
    seal = out / "sealed" / f"{token}.json"
    seal.parent.mkdir(parents=True, exist_ok=True)
    chosen = {name: asked[name] for name in CHOSEN if name in asked}
    try:
        found = drawn(np.random.default_rng(seed), asked["bench"], **chosen)
        case = _recorded(found, out / "open" / token, record)
    except (OutOfReach, RuntimeError) as error:
        write_json(seal, {"asked": dict(asked), "error": str(error)})
        return
    except (TypeError, ValueError) as error:
        raise WorldError(f"case {token}: {error}") from error
    other = another(case, np.random.default_rng([*seed, 2]))
    write_rows(out / "open" / token / "drive.npz", other.drive, at=other.at)
    exact, seen = other.thrust.astype(np.float32), other.measured.astype(np.float32)
    np.savez_compressed(seal.with_suffix(".npz"), thrust=exact, measured=seen)
    told = _truth(found, case) | {"asked": dict(asked), "error": None}
    if asked.get("rivals") and case.effects:
        told["twins"] = nearest(case, case.effects[0].effect, asked)
    write_json(seal, told)


def _recorded(found: Drawn, folder: Path, record: Record) -> Case:
    """The recording alone goes into `folder`. Raises RuntimeError."""
    with TemporaryDirectory(prefix="bench-") as temporary:
        path, case = run(found, Path(temporary) / "campaign", record)
        folder.mkdir(parents=True, exist_ok=True)
        shutil.move(path, folder / "0.h5")
    return measured(replace(case, effects=tuple(replace(c, seen=0.0) for c in case.effects)))


def _truth(found: Drawn, case: Case) -> dict[str, Any]:
    on = found.bench
    chain = {"name": on.name, "host": asdict(on.host), "loop_rate": on.loop_rate, "filter_time": on.cell.filter_time}
    chain |= {"devices": {name: asdict(options) for name, options in on.devices.items()}}
    told, (run,) = truth(case), case.runs
    effects = [_on_its_clock(effect, run.start) for effect in told["effects"]]
    return told | {"effects": effects, "bench": chain, "thruster": asdict(case.thruster)}


def _on_its_clock(effect: Mapping[str, Any], start: float) -> dict[str, Any]:
    """The bench had run for `start` s when the recording began: an instant is told by the recording's clock."""
    known = dict(effect["parameters"])
    if "start" in known:
        known["start"] -= start
    return {**effect, "parameters": known}
