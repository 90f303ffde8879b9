"""An answer while it is put together: all but the verdict, which is decided once, at the end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identification.mismatch.diagnosis import Finding, Mismatch
from identification.mismatch.value import Value
from identification.twin import Twin


@dataclass(frozen=True, eq=False, slots=True)
class Draft:
    """What channel faults, a twin and lines in the spectrum add to; fields as of Diagnosis."""

    baseline_model: str
    baseline: Mapping[str, Value]
    mismatch: tuple[Mismatch, ...]
    findings: tuple[Finding, ...]
    model_terms: tuple[str, ...]
    model: Mapping[str, Value]
    notes: tuple[str, ...] = ()
    twin: Twin | None = None
