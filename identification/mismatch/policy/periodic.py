"""Thresholds: what is a line, an order of the rotor or a peak of the noise."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

LINE_FALSE_ALARM = Threshold(
    0.005,
    unit="probability",
    reason=(
        "The highest of thousands of frequencies must be one that noise alone reaches in five clean "
        "recordings of a thousand: the search for effects has its own rate."
    ),
    evidence=(
        "docs/proof.md (benchmarks/proof/scores.jsonl.gz): 1 of 1,002 clean recordings was given a periodic "
        "disturbance."
    ),
)
LOCKED_LINE_SHARE = Threshold(
    0.2,
    unit="share of LINE_FALSE_ALARM",
    reason=(
        "Lines locked to the rotor stand in noise that differs from stretch to stretch, so that their "
        "p-values are less exact; those that matter are far beyond."
    ),
    evidence="Of 300 clean recordings of the development four had one at p = 0.0002 to 0.003.",
)
LINES = Count(
    4,
    unit="lines",
    reason="A spectrum with more lines than this is no thrust with pick-up: what is left goes on as noise.",
)
LOWEST_LINE = Threshold(
    1.0,
    unit="Hz",
    reason="Below this a residual is full of steps that are repeated, not of lines.",
)
LINE_PERIODS = Count(
    10,
    unit="periods in a run",
    reason="A wave that came fewer times is told from slow noise by nothing.",
)
LEAST_PASSED = Threshold(
    0.1,
    unit="1",
    reason=(
        "Of a force that window and low pass of its device leave less of than this no wave would be seen: one that is "
        "came in behind them, or is the alias of a faster one, and is told as large as the samples show it."
    ),
)
LINE_SAMPLES = Count(
    100,
    unit="samples",
    reason="A run with fewer samples has too few frequencies to tell a line from its neighbours.",
)
LINE_KINDS_CHI2 = Threshold(
    10.0,
    unit="chi-square",
    reason="Fixed and rotor-locked lines that differ by less are both kept, one as the rival of the other.",
)
UNSETTLED = Threshold(
    0.4,
    unit="s",
    reason=(
        "So long after a step a residual is no noise but what the model lacks of dynamics, and no noise peak "
        "is looked for in it."
    ),
)
SETTLED_GAIN = Threshold(
    0.5,
    unit="times what a wave takes everywhere, by its own power",
    reason=(
        "What a line takes from the residual it takes wherever it is; what a model lacks of dynamics is left after "
        "steps, and a wave that is fitted to it makes the rest of the run worse."
    ),
    evidence=(
        "difference/changed/3 of draw 2031-08-01: four lines locked to the rotor, fitted to 3 % of the samples; of "
        "the others each makes them worse."
    ),
)
SETTLED_LEAST = Threshold(
    0.25,
    unit="share of the power of a wave",
    reason="Where less of a run is long past a step, what it shows there says nothing about the rest.",
)
NOISE_BANDS = Count(
    1,
    unit="bands",
    reason="One resonance of stand or cell is told to the noise model; more would take the whole spectrum for noise.",
)
FULL_RATE_SAMPLES = Count(
    400,
    unit="samples",
    reason="Where every run has fewer nothing is looked for at full rate.",
)
RATE_BLOCKS = Count(
    10,
    unit="blocks",
    reason="Fewer blocks tell nothing of whether a measured rate wanders.",
)
RATE_WANDERS_SIGMA = Threshold(
    4.0,
    unit="sigma",
    reason="A rate whose sum over blocks differs by more from the model's wanders, and is itself taken for the angle.",
)
TURNING_SPEED = Threshold(
    0.05,
    unit="share of the highest speed",
    reason="Below it a rotor may stand still in jerks, and its angle is not known.",
)
LINE_WIDTH = Threshold(
    1.0,
    unit="1/T",
    reason=(
        "A noise peak of this half width behaves as a line over the run: the noise that must explain a line "
        "is at least as wide."
    ),
)
APART = Threshold(
    8.0,
    unit="1/T",
    reason=(
        "A narrow resonance of the noise has as many peaks beside one another as it lasts times; two sources whose "
        "waves are told apart by so little more than the length of the run are hardly found in one thrust."
    ),
    evidence=(
        "bench/nothing/2 of draw 2028-02-02: 5.154 and 5.182 Hz, 5/T apart, in mixed noise in which nothing is hidden."
    ),
)
HIGHEST_ORDER = Threshold(
    400.0,
    unit="Hz at the highest speed",
    reason=(
        "Blade pass of the fastest thrusters with their harmonics lies below it, and each more would cost false alarms."
    ),
)
LOWEST_ORDER = Threshold(
    1.0,
    unit="Hz at the highest speed",
    reason="Slower than a turn or so nothing is locked to a rotor.",
)
FEWEST_A_TURN = Threshold(
    0.3,
    unit="periods a turn",
    reason=(
        "The slowest that a rotor makes by itself is the whirl in its bearings, 0.42 to 0.48 times a turn (Muszynska, "
        "Rotordynamics, 2005, ch. 4): what comes more seldom is the plan's, or noise."
    ),
    evidence=(
        "wide_near_steps and wide_quantised of draw 2027-06-06: 0.136 and 0.036 periods a turn in two of 204 clean "
        "recordings."
    ),
)
STEADY_SPEED = Threshold(
    0.05,
    unit="share of its speed",
    reason="A stretch whose speed changes by less becomes neither faster nor slower.",
)
UNEVEN_WAVE_P = Threshold(
    1e-3,
    unit="probability",
    reason=(
        "Waves that differ so much between speeds are no one wave: what a plan repeats, or a model's error, "
        "comes back too."
    ),
)
ODD_ORDER_SHARE = Threshold(
    0.02,
    unit="share of the false-alarm rate of a locked line",
    reason="Waves come a whole number of times a turn nearly always, so that little of the rate is left to all others.",
)
WHOLE_ORDER_NEAR = Threshold(
    0.003,
    unit="share of the ratio",
    reason="So well the scale of a measured rate is known: a ratio this near to a whole number is one.",
)
LOCKED_LINE_GAIN = Threshold(
    25.0,
    unit="chi-square",
    reason=(
        "A locked line must explain this much when it is fitted: its p-value alone rests on noise that is "
        "less well known."
    ),
)
ORDER_LAW_CHI2 = Threshold(
    4.0,
    unit="chi-square",
    reason=(
        "Forces of a rotor grow with the square of its speed, so that a wave of one size at all speeds, or one that a "
        "ringing stand makes larger, must explain more by two sigma."
    ),
)
COHERENT_PHASE_P = Threshold(
    0.01,
    unit="probability",
    reason="A wave keeps its phase over longer pieces where what that costs is no more than noise.",
)
LOWEST_BAND = Threshold(
    0.5,
    unit="Hz",
    reason="Slower noise is what the exponential scales of the noise model are for.",
)
BAND_SAMPLES = Count(
    400,
    unit="samples",
    reason="The spectrum of a shorter run has too few averages to tell a peak from its background.",
)
BAND_SIGMA = Threshold(
    6.0,
    unit="sigma of the averaged background",
    reason=(
        "A peak must stand above its background by so much: hundreds of frequencies and four averages are looked at."
    ),
)
BAND_EXCESS = Threshold(
    0.5,
    unit="share of the background",
    reason="Smaller peaks do no harm to intervals and p-values, and are left as they are.",
)
BAND_GAIN = Threshold(
    40.0,
    unit="twice the log likelihood",
    reason="A peak has three parameters at a place that was picked, so its gain must be plain.",
)
BAND_WIDTH = Threshold(
    2.0,
    unit="1/T",
    reason="What is narrower is a line, and belongs to the search for lines.",
)
SPECTRUM_CLIP = Threshold(
    5.0,
    unit="robust sigma",
    reason="A residual farther out is cut there: a few bad samples have power at all frequencies.",
    evidence="docs/proof.md: no false alarm in 167 clean recordings with heavy-tailed noise.",
)
SLOWEST_STRETCH_WAVE = Threshold(
    1.0,
    unit="Hz",
    reason="What is slower in a stretch, or its alias, is what a model leaves after a step.",
)
STRETCH_SAMPLES = Count(
    24,
    unit="samples",
    reason="A shorter stretch tells no wave from its noise.",
)
STRETCH_TURNING = Threshold(
    0.1,
    unit="share of the highest speed",
    reason="Below it the rotor counts as at rest, and a stretch tells nothing of an order.",
)
STRETCH_SPEED_JUMP = Threshold(
    0.04,
    unit="share of the highest speed",
    reason="A larger change between samples begins a new stretch: over it no wave of the rotor keeps its frequency.",
)
COMES_AGAIN_P = Threshold(
    0.01,
    unit="probability",
    reason=(
        "A line is told by name where the runs, or the quarters of the only run, other than the one that shows it best "
        "would look so much like it once in a hundred times by noise alone; else it was seen once."
    ),
)
MAINS_WANDER = Threshold(
    0.002,
    unit="share of the frequency",
    reason=(
        "The frequency of the mains is kept within it nearly always, so a line so near to it is of the mains, "
        "and two such lines are one."
    ),
    evidence="ENTSO-E: the frequency is kept within 0.1 Hz of 50 nearly always.",
)
BLADE_RATIO_NEAR = Threshold(
    0.02,
    unit="periods per turn",
    reason="A line so near to a whole number of periods per turn is said to be of the blades or an order of the shaft.",
)
LOWEST_BAND_QUALITY = Threshold(
    0.7,
    unit="1",
    reason="A peak that is broader is no resonance: the exponential scales of the noise model describe it.",
)
HIGHEST_BAND_QUALITY = Threshold(
    200.0,
    unit="1",
    reason="A peak that is sharper is a line, or rings for longer than a run.",
)
EQUAL_HOLDS = Count(
    8,
    unit="holds",
    reason="Fewer repeat too seldom to make lines that stand above the noise beside them.",
)
HOLD_DIFFERENCE = Threshold(
    0.02,
    unit="share of the median hold",
    reason="Ticks of the command and stamps differ by less; holds that differ by more do not add up over tens of them.",
)
EQUAL_HOLDS_SHARE = Threshold(
    0.75,
    unit="share of the holds",
    reason="A plan keeps its rhythm although some levels come twice in a row, and rests are longer.",
)
PLAN_HARMONICS = Count(
    30,
    unit="multiples of the rate of steps",
    reason=(
        "What is left a thirtieth of a hold after each step is the last that makes such lines; mains and blade pass "
        "lie above it."
    ),
    evidence="A cell behind a low pass of 10 ms, steps every 3 s: lines told at 1, 1.333, 1.667 and 2 Hz.",
)
