"""Thresholds: what is left that is more than noise, and where it is told."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

RESIDUAL_FALSE_ALARM = Threshold(
    0.004,
    unit="probability",
    reason=(
        "What is left is called structure only where noise leaves as much, over any covariate, in four clean "
        "recordings of a thousand: beside a search at 1 % it adds little."
    ),
    evidence=(
        "docs/proof.md (benchmarks/proof/scores.jsonl.gz): 2 of 1,002 clean recordings were called "
        "unexplained without any term found."
    ),
)
OUTLIER_SIGMA = Threshold(
    4.0,
    unit="sigma",
    reason=(
        "A row farther out counts as one this far out: one outlier is no structure, and heavy tails would "
        "make some of it."
    ),
    evidence="docs/proof.md: no false alarm in 167 clean recordings with heavy-tailed noise.",
)
PLAIN_STRUCTURE_P = Threshold(
    1e-7,
    unit="probability",
    reason=(
        "Structure that noise of any kind makes so rarely is believed without the surrogates: jumps and "
        "pulses among hundreds of instants, and what must not be in the draws."
    ),
    evidence="docs/proof.md: all 20 aeration pulses and 16 of 20 removed jumps of the zero were located.",
)
SLOW_CHANGE_FALSE_ALARM = Threshold(
    1e-5,
    unit="probability",
    reason=(
        "The likelihood ratio of noise models is no exact chi-square, so a change of zero or gain that "
        "wanders over the run is told only far beyond what clean recordings reach."
    ),
    evidence="benchmarks/diagnosis/hidden_gains.py prints the smallest p-values on clean recordings.",
)
UNREST_FALSE_ALARM = Threshold(
    1e-4,
    unit="probability",
    reason=(
        "Noise after steps is told from stationary noise only where it plainly describes more: it raises the bar of "
        "what is left, and an answer of which nothing is left tells its values by it."
    ),
    evidence=(
        "docs/proof.md, the lane `wide`: alarms of wide_near_steps and wide_mixture with it and without; "
        "docs/method.md, answer: C of 11 baselines within 1.96 standard errors in 10, without it in 6."
    ),
)
PULSES = Count(
    4,
    unit="pulses",
    reason="What came fewer times did not come back: two or three strokes of slow noise fit some period always.",
)
PULSE_ROWS = Count(
    60,
    unit="rows",
    reason="A run with fewer rows shows no period beside the plan's own.",
)
PLAN_IN_STEP = Threshold(
    0.5,
    unit="share of the variance of the force",
    reason=(
        "Where the phase explains more, the plan itself comes back with that period, and makes pulses of "
        "anything that is left."
    ),
)
COLOURED_RESIDUAL_P = Threshold(
    1e-25,
    unit="probability of whiteness",
    reason=(
        "Below it no noise is blamed for the colour of what is left; above it the noise model may simply be a poor one."
    ),
    evidence="1/f noise alone was seen to reach 1e-21 in the development's clean recordings.",
)
UNCARRIED_SIGMA = Threshold(
    6.0,
    unit="sigma",
    reason=(
        "A direction of the last screening that no term made anything of counts as left where it stands out "
        "so far that its shape does not matter."
    ),
)
PLACE_P = Threshold(
    1e-3,
    unit="probability",
    reason=(
        "A place is told beside the clearest one only where it is plain itself: places of one mismatch are "
        "seen over many covariates."
    ),
)
PLACES_TOLD = Count(
    3,
    unit="places",
    reason="More than three places say nothing more of where the baseline fails.",
)
PLACE_SHARE = Threshold(
    0.7,
    unit="share of the structure's power",
    reason=(
        "The stretch that is told is the shortest that holds this much of what is left: all of it would be "
        "the whole covariate, for noise is everywhere."
    ),
)
