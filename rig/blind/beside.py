"""What is shown beside a proof: figures of other methods on recordings of ours, answers to recordings of others.

The programs that find them write them (`--json` of benchmarks/peers.py and of the examples with real recordings),
`rig prove --beside` shows them. Both ends use the dataclasses below: their fields are the keys of the file.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, FiniteFloat, NonNegativeInt, TypeAdapter, ValidationError

from identification.mismatch.diagnosis import Diagnosis
from rig.blind.store import ProofError
from rig.errors import RigError

WRITERS: Final = "`benchmarks/peers.py --json` or `examples/real_diagnosis.py --json`"
PEERS: Final = "thruster-rig-peers"
REAL: Final = "thruster-rig-real-recordings"
Positive = Annotated[FiniteFloat, Field(gt=0.0)]


@dataclass(frozen=True, slots=True)
class Named:
    """Recordings with a concealed effect, by what was named. They add up to all of them."""

    alone: NonNegativeInt
    among: NonNegativeInt
    """The effect beside other names, or as a stated rival."""
    wrong: NonNegativeInt
    none: NonNegativeInt

    @property
    def n(self) -> int:
        return self.alone + self.among + self.wrong + self.none


@dataclass(frozen=True, slots=True)
class AtStrength:
    """One method where the effect has one strength. Errors: on another recording, over that of its noise."""

    strength: Positive
    """Sigma at which an oracle sees the effect."""
    named: Named | None
    """None of what never names anything: a baseline."""
    error_median: FiniteFloat | None
    error_95: FiniteFloat | None
    """Below which 95 % of the recordings are."""
    seconds: FiniteFloat
    """CPU s, median."""


@dataclass(frozen=True, slots=True)
class Method:
    """One method on all recordings: its setting, what it found at each strength, and its false alarms."""

    name: str
    setting: dict[str, FiniteFloat | str]
    at: tuple[AtStrength, ...]
    alarms: NonNegativeInt
    """Clean recordings with a name, and without one."""
    quiet: NonNegativeInt


@dataclass(frozen=True, slots=True)
class Peers:
    """Several methods on the same recordings, which those of the proof are not."""

    diagnosis: str
    """Version of the diagnosis, and of the world that made the recordings."""
    world: str
    first_seed: NonNegativeInt
    each: NonNegativeInt
    """Recordings of each kind: clean, and of each strength."""
    packages: dict[str, str]
    """Versions of the peers."""
    methods: tuple[Method, ...]
    format: Literal["thruster-rig-peers"] = PEERS
    version: Literal[1] = 1


@dataclass(frozen=True, slots=True)
class HeldOut:
    """RMSE per sample of what was not fitted, in the unit of the response. None where there is no such number."""

    before: FiniteFloat | None
    after: FiniteFloat | None
    noise: FiniteFloat | None
    what: str


@dataclass(frozen=True, slots=True)
class Found:
    """One effect that was named, with the effects that the recording cannot tell from it."""

    effect: str
    form: str
    statement: str
    rivals: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RealCase:
    """What was said of one real recording; errors of what was held out are in `unit`."""

    name: str
    verdict: Literal["adequate", "explained", "ambiguous", "unexplained", "refused", "crashed"]
    statement: str
    """Of what was refused, or crashed: why."""
    findings: tuple[Found, ...] = ()
    response: str = ""
    unit: str = ""
    held_out: HeldOut | None = None


@dataclass(frozen=True, slots=True)
class RealRecordings:
    """What one version of the diagnosis says of recordings of real thrusters: no truth is known of them."""

    diagnosis: str
    """Version of the diagnosis."""
    cases: tuple[RealCase, ...]
    format: Literal["thruster-rig-real-recordings"] = REAL
    version: Literal[1] = 1


Beside = Peers | RealRecordings
KINDS: Final[dict[str, TypeAdapter[Any]]] = {PEERS: TypeAdapter(Peers), REAL: TypeAdapter(RealRecordings)}


def real_case(name: str, found: Diagnosis) -> RealCase:
    """What is kept of an answer."""
    held = found.heldout
    return RealCase(
        name,
        found.verdict,
        found.statement,
        tuple(Found(f.effect, f.form, f.statement, tuple(r.effect for r in f.rivals)) for f in found.findings),
        found.response,
        found.unit,
        HeldOut(_number(held.before), _number(held.after), _number(held.noise), held.what),
    )


def unanswered(name: str, error: Exception) -> RealCase:
    """Refused by a sentence that an operator sees, or crashed."""
    if isinstance(error, RigError):
        return RealCase(name, "refused", str(error))
    return RealCase(name, "crashed", f"{type(error).__name__}: {error}")


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def write(path: Path, figures: Beside) -> None:
    """Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(_json(figures), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read(path: Path) -> Beside:
    """Raises ProofError naming file, key, what was expected and what came."""
    again = f"give a file that {WRITERS} wrote"
    try:
        text = path.read_text(encoding="utf-8")
        content = json.loads(text)
    except OSError as error:
        raise ProofError(f"{path} can't be read ({error.strerror}); {again}") from error
    except ValueError as error:
        raise ProofError(f"{path} is nothing to show beside a proof: it is not JSON ({error}); {again}") from error
    kind = str(content.get("format")) if isinstance(content, dict) else type(content).__name__
    if kind not in KINDS:
        raise ProofError(f"{path}: expected the format {' or '.join(KINDS)}, got {kind!r:.60}; {again}")
    return _checked(path, KINDS[kind], text)


def _checked(path: Path, kind: TypeAdapter[Any], text: str) -> Beside:
    try:
        found: Beside = kind.validate_json(text, strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        came = "" if first["type"] == "missing" else f", got {first['input']!r:.60}"
        raise ProofError(f"{path}: {place}: {first['msg']}{came}; write it anew with {WRITERS}") from error
    return found


def beside_json(shown: Sequence[Beside]) -> dict[str, Any]:
    """The keys of their own that they have in the figures of the proof."""
    return {
        "peers": [_json(each) for each in shown if isinstance(each, Peers)],
        "real_recordings": [_json(each) for each in shown if isinstance(each, RealRecordings)],
    }


def _json(figures: Beside) -> dict[str, Any]:
    """With what it is at the top."""
    return {"format": figures.format, "version": figures.version} | asdict(figures)
