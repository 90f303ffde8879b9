"""Thresholds: what the diagnosis of a vehicle decides otherwise than that of a thruster."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

VEHICLE_PART_DIFFERENCE = Threshold(
    0.15,
    unit="share of the parameter",
    reason=(
        "Parts of the recordings whose parameters differ by less count as the same: a vehicle's forces are "
        "known less well than a thrust."
    ),
)
VEHICLE_MODEL_TERMS = Count(
    5,
    unit="terms",
    reason="Trials of a vehicle determine no more effects beside its drag, mass and currents.",
)
VEHICLE_CANDIDATE_GAIN = Threshold(
    0.2,
    unit="share of the best candidate's gain",
    reason="What promises less is not fitted in this round.",
)
VEHICLE_NOT_WHITE_P = Threshold(
    1e-3,
    unit="probability of whiteness",
    reason="Below it a note says that white and slow noise do not describe the sensor.",
)
VEHICLE_SWEEP_POWER = Threshold(
    0.5,
    unit="probability of a right decision",
    reason="Below it no free run tells the two apart, and mooring to a force gauge is proposed.",
)
VEHICLE_RUNS = Count(
    3,
    unit="runs",
    reason="With fewer, blocks of time are kept back: a model of one run says little of another.",
)
MOTION_SAMPLES = Count(
    20,
    unit="samples",
    reason="Drag, mass, a current and a residual that says anything need so many: fewer are refused.",
)
THRUST_KNOWN = Threshold(
    0.5,
    unit="relative standard deviation",
    reason="Above it a thruster's model counts as not known, and is found with the vehicle's.",
)
AHEAD_ASTERN_SHARE = Threshold(
    0.1,
    unit="share of the time",
    reason="With less of the time in one direction nothing is compared between both.",
)
HEADING_SPREAD = Threshold(
    1e-3,
    unit="rad",
    reason="A heading that turns by less is constant, and no covariate.",
)
SLOW_DISTURBANCE = Threshold(
    2.0,
    unit="times the white noise",
    reason=(
        "Slow noise above it is waves, wind or a hand on the cable rather than the sensor, and a note says "
        "how large it is."
    ),
)
