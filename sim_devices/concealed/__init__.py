"""Recordings in which physics is concealed with a known strength: the simulated half of the blind proof.

    import numpy as np
    from sim_devices import concealed

    rng = np.random.default_rng(1)
    case = concealed.case(rng, ["dead_band"], strength=40.0)           # everything else drawn; see draw.case
    pair = concealed.case(rng, ["asymmetry", "heating"], 20.0, plan="interleaved", noise="white", channels=[])
    clean = concealed.case(rng)                                        # tau = C V|V|, noise, one zero per run
    lies = concealed.case(rng, lie="swapped")                          # a channel fault, of LIES
    field = concealed.composite(rng, ["dead_band", "heating"])         # as much of each as the field has
    both = concealed.difference(rng, ["asymmetry"], "heating", 15.0)   # .first, and .second with heating beside it
    arrays = concealed.rows(case)                                      # [Rows]: columns of plain arrays, steps
    truth = concealed.truth(case)                                      # dict for a sealed JSON file

`strength` is d': the sigma at which an oracle sees the effect that knows it, its shape and the noise (`oracle`).
`concealed.twins(case, effect, rivals, rng)`: how many sigma each rival would leave in place of the effect.
Effects are the ids of `cases.shapes.SHAPES`: the world's catalogue, and those of `world.effects.uncatalogued`.

What a clean recording still holds: thrust C V|V| of the command in force at each sample, at once (rotor
"instant"), one zero per run, the noise of its law. Beside it n = k V, the current drag n|n| / torque_acceleration,
the winding's warmth, a bus that stands still or (decoy) sags while the drive makes up for it, a flow that may change
and does nothing.
This package knows nothing of identification or rig; `tests/concealed/recordings.py` makes Recordings of the rows.
"""

from sim_devices.concealed.cases.definition import Case
from sim_devices.concealed.cases.faults import KINDS as LIES
from sim_devices.concealed.cases.faults import Column
from sim_devices.concealed.cases.field_size import FIELD
from sim_devices.concealed.cases.forms import FORMS, VARIANTS
from sim_devices.concealed.cases.plans import KINDS as PLAN_KINDS
from sim_devices.concealed.cases.shapes import SHAPES
from sim_devices.concealed.cases.wide_noise import WIDE_NOISE_KINDS
from sim_devices.concealed.composites import ADDED, Difference, composite, difference
from sim_devices.concealed.draw import NOISE_KINDS, case
from sim_devices.concealed.sealing.records import Rows, rows, truth
from sim_devices.concealed.visibility.oracle import OutOfReach, scaled_to, strength
from sim_devices.concealed.visibility.rivals import twins

__all__ = [
    "ADDED",
    "FIELD",
    "FORMS",
    "LIES",
    "NOISE_KINDS",
    "PLAN_KINDS",
    "SHAPES",
    "VARIANTS",
    "WIDE_NOISE_KINDS",
    "Case",
    "Column",
    "Difference",
    "OutOfReach",
    "Rows",
    "case",
    "composite",
    "difference",
    "rows",
    "scaled_to",
    "strength",
    "truth",
    "twins",
]
