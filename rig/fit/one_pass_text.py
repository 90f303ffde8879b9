"""A fit in one pass (`rig.fit.one_pass`) in words and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from identification.estimation.batches import BATCHES
from identification.steady_state.settling import LONGEST_CUT
from identification.thruster.thrust_data import gain_std
from identification.thruster.thrust_report import digits
from rig.fit.answer import unclosed
from rig.fit.as_json import parameter_json
from rig.fit.columns import laid_out
from rig.fit.one_pass import OnePass


def remarks(found: OnePass) -> Iterator[str]:
    """One sentence for each thing to know before the numbers are used."""
    how = sorted({run.rows.method for run in found.passes if run.rows is not None})
    yield f"{found.rows} samples read in one pass ({', '.join(how)}), in blocks: memory does not grow with them"
    if any(run.windows for run in found.passes):
        yield f"of each marked hold the last {100 * (1 - LONGEST_CUT):.0f} % were used, sample by sample"
    worst = max(found.parameters.values(), key=lambda p: p.std_statistical / p.std_internal if p.std_internal else 0.0)
    ratio = worst.std_statistical / worst.std_internal if worst.std_internal else float("nan")
    length = max((run.last - run.first) / BATCHES for run in found.passes)
    yield (
        f"standard errors from the scatter of {found.spread.batches} batches of {length:.3g} s or more; "
        f"taken as uncorrelated, the samples would give {1 / ratio:.2g} of that"
    )
    if found.spread.slow:
        yield (
            f"the noise is slower than these batches (neighbours correlate by {found.spread.serial:.2f}): the standard "
            "errors are too small; return to rest more often, or record for longer"
        )
    if skipped := sum(run.skipped for run in found.passes):
        yield f"{skipped} thrust samples were left out: not a number, or at no known voltage"
    if len(found.passes) > 1:
        sources = (run.recording.source or run.recording.recording_id for run in found.passes)
        yield ", ".join(f"tare {k} is of {source}" for k, source in enumerate(sources, start=1))
    yield from unclosed(run.recording for run in found.passes)
    quantity = found.passes[0].source.quantity
    if quantity != "command_voltage":
        yield f"explained by {quantity}, not by the command"
    if not any(gain_std(run.thrust) for run in found.passes):
        yield "calibration uncertainty of the load cell is not stated (gain_std): std is statistical only"


def one_pass_text(found: OnePass) -> str:
    """Sentence, table, remarks; plain text."""
    count, plural = len(found.passes), "s" if len(found.passes) > 1 else ""
    lines = [
        f"{found.thruster or 'thruster'}: thrust = {found.form.name} + tare; RMSE {found.rmse:.3g} N over {found.rows} "
        f"samples of {count} recording{plural}, {found.form.name} by {found.passes[0].source.quantity}",
        "",
    ]
    rows: list[tuple[str, ...]] = [("", "value", "std", "95 % from", "to", "unit")]
    tares = {"tare" if count == 1 else f"tare {k + 1}": p for k, p in enumerate(found.tare.values())}
    for name, p in (found.parameters | tares).items():
        numbers = [digits(x, p.std) for x in (p.value, p.std, p.low, p.high)]
        rows.append((name, *numbers, p.unit))
    return "\n".join(
        [*lines, *laid_out(rows, "<9 >14 >12 >14 >14 <0"), "", *(f"  - {text}" for text in remarks(found))]
    )


def one_pass_json(fits: Sequence[OnePass]) -> dict[str, Any]:
    """`thruster-rig-fit` version 1, the keys of a fit in memory as far as they apply, and `one_pass`."""
    return {"format": "thruster-rig-fit", "version": 1, "fits": [_entry(found) for found in fits]}


def _entry(found: OnePass) -> dict[str, Any]:
    return {
        "thruster": found.thruster,
        "recordings": [run.recording.recording_id for run in found.passes],
        "model": found.form.name,
        "parameters": {name: parameter_json(p) for name, p in found.parameters.items()},
        "tare": {name: parameter_json(p) for name, p in found.tare.items()},
        "rmse": found.rmse,
        "rmse_of": "samples",
        "n": found.rows,
        "dof": found.fit.dof,
        "sigma": float(np.sqrt(found.fit.sigma2 or 0.0)),
        "singular_values": found.fit.singular_values.tolist(),
        "condition": found.fit.condition,
        "voltage": found.passes[0].source.quantity,
        "skipped_samples": sum(run.skipped for run in found.passes),
        "one_pass": {"batches": found.spread.batches, "serial": found.spread.serial, "slow": found.spread.slow},
        "verdicts": list(remarks(found)),
    }
