"""Channel faults in the answer: grave ones are its first findings, the others notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch.answer.draft import Draft
from identification.mismatch.diagnosis import Finding
from identification.mismatch.faults.channel_faults import EFFECT, Fault
from identification.mismatch.value import Value

LEAST_P = 1e-300
"""Smallest p-value that is written: 0 has no logarithm for those who draw it."""


def fault_finding(fault: Fault) -> Finding:
    """A channel that lies as a finding: its kind is the form, and the BIC gain is that of its p-value alone."""
    values = {k: Value(v.value, v.std, v.unit) for k, v in fault.parameters.items()}
    p = max(fault.p_value, LEAST_P)
    channels = (fault.channel, fault.other) if fault.other else (fault.channel,)
    return Finding(
        EFFECT,
        fault.kind,
        fault.statement,
        values,
        p,
        -2 * float(np.log(p)),
        1.0,
        (),
        searched=None,
        channels=channels,
        recording=fault.recording_id,
        in_measurement=True,
    )


def with_channels(draft: Draft, faults: Sequence[Fault], recordings: Sequence[str]) -> Draft:
    """`recordings`: ids of those that are diagnosed; a fault says its recording unless that is the only one."""
    grave = [f for f in faults if f.grave and f.kind != "nan"]
    alone = {f.recording_id for f in grave} <= set(recordings) and len(recordings) == 1
    faulty = (f if alone or f.done else replace(f, statement=f"{f.recording_id}: {f.statement}") for f in grave)
    notes = [f"{f.recording_id}: {f.statement}" for f in faults if f not in grave]
    notes += [f.done or f"for the model this was put right: {f.statement}" for f in grave if f.done or f.repairable]
    findings = (*map(fault_finding, faulty), *draft.findings)
    return replace(draft, findings=findings, notes=(*draft.notes, *notes))
