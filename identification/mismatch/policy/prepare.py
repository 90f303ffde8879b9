"""Thresholds: which samples of a recording count, and what of a driver or a channel is noise."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

SMOOTHING_AGREES_SIGMA = Threshold(
    2.5,
    unit="sigma",
    reason=(
        "A longer reach is used while what it makes of a sample agrees with every shorter one: noise is "
        "averaged, motion is not."
    ),
    evidence="Lepski, Theory Probab. Appl. 35 (1990) 454.",
)
KINKED_VARIANCE = Threshold(
    4.0,
    unit="times the usual variance",
    reason="Beside a kink few samples agree, and what they make of it is not trusted more than one sample is.",
)
KINK_SIGMA = Threshold(
    2.5,
    unit="sigma",
    reason=(
        "Lines before and after a sample that miss each other by more have a kink between them, over which "
        "nothing is averaged."
    ),
)
BENT_SIGMA = Threshold(
    3.5,
    unit="sigma of a second difference",
    reason=(
        "A sample at which the driver bends by more is an end of what is averaged: no straight line goes through it."
    ),
)
STILL_SAMPLES = Count(
    8,
    unit="samples",
    reason="Fewer samples do not tell a level that stands still from one that moves slowly.",
)
STILL_SIGMA = Threshold(
    2.5,
    unit="sigma",
    reason="A level whose slope and correlation of neighbours are within this stands still, and is its mean.",
)
STILL_VARIANCE_SIGMA = Threshold(
    3.0,
    unit="sigma of the variance",
    reason="A level whose samples scatter by more than white noise would moves, however little its slope is.",
)
CHANNEL_WINDOW_SIGMA = Threshold(
    3.0,
    unit="sigma",
    reason=(
        "A running mean grows while a wider window differs from a narrow one by no more than its noise: wide "
        "where a channel rests, narrow where it follows a step."
    ),
    evidence="Lepski, Theory Probab. Appl. 35 (1990) 454.",
)
SUPPLY_REST_TOLD = Threshold(
    0.005,
    unit="share of the variance beside the load",
    reason=(
        "Where neighbours foretell less of a supply's rest it is noise, and noise in what explains makes "
        "effects look smaller."
    ),
)
COARSE_STEPS = Threshold(
    20.0,
    unit="steps of its readings",
    reason=(
        "A step's own error is 1/sqrt(12) of it, so that a supply known by 20 of them is known to 1.5 % of its way at "
        "best, which a rate read to a part in ten thousand shows; what stands for it then may stand beside it."
    ),
    evidence="bench/plain:supply_sag of draw 2026-12-01: falls of 0.1 to 7 steps of a VESC's 0.1 V, none told rightly.",
)
COMMAND_STEP = Threshold(
    0.02,
    unit="share of the largest driver",
    reason=(
        "A smaller change of a command is a tick of a ramp; a larger one is a step, an edge of an interval, "
        "near which samples are dropped."
    ),
)
DRIVER_JUMP = Threshold(
    0.02,
    unit="share of the largest driver",
    reason=(
        "A smaller change between two samples of a measured driver is no jump: the thrust across it is told "
        "by a straight line."
    ),
)
DRIVER_JUMP_ALONE = Threshold(
    3.0,
    unit="times the changes on both sides",
    reason="A jump is quicker than the samples; what merely moves goes on in the next ones.",
)
DRIVER_NOISE_SIGMA = Threshold(
    6.0,
    unit="sigma",
    reason="What changes by less may be noise of the driver.",
)
LOUD_DRIVER = Threshold(
    1e-4,
    unit="share of the largest driver",
    reason="Noise above this is averaged before any dynamics see it: a lag averages noise too, and would be found.",
    evidence=(
        "docs/howto/diagnose.md: of 140 random clean runs driven by a rate with noise up to 0.5 % 132 were adequate."
    ),
)
DRIVER_NOISE_UNSEEN = Threshold(
    0.5,
    unit="share of the noise of a thrust sample",
    reason="What a driver's own noise makes of the thrust is not seen below half of the thrust's own.",
)
STRAIGHT_LINE_UNSEEN = Threshold(
    0.2,
    unit="share of the noise of a thrust sample",
    reason=(
        "What a straight line between samples is off by must be smaller still: after each step it is off "
        "alike, and adds up."
    ),
)
DRIVER_ERROR_UNSEEN = Threshold(
    1e-3,
    unit="share of the thrust at the largest driver",
    reason="A smaller error of the driver is not seen whatever the noise: models are not truer.",
)
SAMPLE_INSTANT = Threshold(
    1e-3,
    unit="share of the time between two samples",
    reason="A thrust so near to a sample of the driver is of its instant, and a jump beside it does not matter.",
)
SAMPLES_LEFT = Threshold(
    0.5,
    unit="share of the samples",
    reason=(
        "Thrust that the driver does not explain well enough is dropped only while half of it is left; then "
        "more error is allowed."
    ),
)
JITTER_SHARE = Threshold(
    0.1,
    unit="share of the time between samples",
    reason=(
        "Where samples are dense and even, so good are their stamps: what is nearer to a step may belong to "
        "either level."
    ),
)
JITTER_SIGMA = Threshold(
    3.0,
    unit="sigma of the time between samples",
    reason="By so much a stamp may be off where spacing scatters.",
)
AFTER_UNKNOWN_COMMAND = Threshold(
    1.0,
    unit="s",
    reason="After a stretch of unknown command thrust counts again only when the rotor follows the known one.",
)
TABLE_DWELL = Threshold(
    0.5,
    unit="s",
    reason="Levels held for less with a sample each are a course of time that was sampled seldom, and no table.",
)
TABLE_SAMPLES = Count(
    3,
    unit="samples of a level",
    reason="More samples of a level show how it is reached: then it is no static table.",
)
STEADY_LEVEL = Threshold(
    0.5,
    unit="s",
    reason="The second half of a level that was held for longer is steady enough to tell rate per volt.",
)
THRUST_SAMPLES = Count(
    5,
    unit="samples",
    reason="C, a tare and a residual that says anything need five samples: fewer are refused.",
)
COURSE_SAMPLES = Count(
    50,
    unit="samples",
    reason=(
        "A recording with a course of time needs so many to tell physics from noise; a table of levels may have fewer."
    ),
)
ONE_LEVEL = Threshold(
    1e-6,
    unit="share of the largest driver",
    reason="Levels nearer than this are one, and one level determines no C beside a tare.",
)
CHANNEL_JUMP_SIGMA = Threshold(
    6.0,
    unit="sigma",
    reason=(
        "Neighbouring samples of a channel that differ by more have a jump between them, over which nothing "
        "is averaged or interpolated."
    ),
)
FLOW_JUMP = Threshold(
    0.03,
    unit="share of the channel's range",
    reason="A flow that jumps by more between two samples changed nobody knows when: thrust between them is dropped.",
)
SAMPLES_CLEAR_OF_FLOW_JUMPS = Threshold(
    0.7,
    unit="share of the samples",
    reason=(
        "A flow that jumps all the time is noisy rather than changing: thrust is dropped only where most of it stays."
    ),
)
JITTER_BEFORE = Threshold(
    0.002,
    unit="s",
    reason=(
        "So long before a step a sample may already belong to the level after it: stamps are not better where "
        "spacing does not say so."
    ),
)
JITTER_AFTER = Threshold(
    0.003,
    unit="s",
    reason="So long after a step a sample may still belong to the level before it.",
)
CLOCK_PAUSE = Threshold(
    20.0,
    unit="periods",
    reason="A device that says nothing for so long may have been started again, with its clock at another phase.",
)
CLOCK_ROWS = Count(
    200,
    unit="rows",
    reason="Among so many arrivals some come in time, and the line below them is that of the clock.",
)
CLOCK_RATE_ERROR = Threshold(
    0.02,
    unit="share of the rate",
    reason="A device whose rate is further from what it says has another clock than it says, or none that is even.",
)
CLOCK_LATE_SHARE = Threshold(
    0.9,
    unit="share of the rows",
    reason="Those that tell whether rows come as from an even clock: the rest may wait for a computer that was busy.",
)
CLOCK_LATEST = Threshold(
    2.0,
    unit="periods",
    reason="Rows of an even clock of which every tenth is later than this are not told from rows that were lost.",
)
