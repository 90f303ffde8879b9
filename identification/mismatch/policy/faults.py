"""Thresholds: when a channel lies."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

CHANNEL_FALSE_ALARM = Threshold(
    1e-3,
    unit="probability",
    reason=(
        "Of one test of one channel, or of all channels of all runs that are compared; what is said must also be far "
        "beyond what any physics of a thruster does, so noise alone never passes."
    ),
    evidence="docs/proof.md (benchmarks/proof/scores.jsonl.gz): no channel fault in 1,002 clean recordings.",
)
MISSING_SHARE = Threshold(
    0.01,
    unit="share of the rows",
    reason="A few bad frames are no fault of a channel.",
)
LEADING_GAP = Threshold(
    0.1,
    unit="share of the rows",
    reason="A device takes time to wake: what is missing before its first number is allowed up to this.",
)
STUCK_ROWS = Count(
    10,
    unit="rows",
    reason="Fewer equal rows happen where a channel has few digits.",
)
STUCK_SHARE = Threshold(
    0.02,
    unit="share of the run",
    reason="A shorter stretch of equal values is a hold rather than a fault.",
)
STUCK_MOVEMENT = Threshold(
    0.25,
    unit="share of the channel's own range",
    reason="By so much a channel should have moved before it is called frozen: friction and quanta hold it for less.",
)
STUCK_ELSEWHERE = Threshold(
    0.1,
    unit="share of the stretch",
    reason="For so much of the stretch the driver must have told it to be elsewhere: a moment's lag is no fault.",
)
LEAP_REST = Threshold(
    0.05,
    unit="share of the largest rate",
    reason="Below it a rotor stands: what a tachometer shows at rest is noise.",
)
LEAP_SHARE = Threshold(
    0.05,
    unit="share of the run",
    reason="A longer motion is a level, or several, of which the thrust tells what it is.",
)
LEAP_BEYOND = Threshold(
    1.2,
    unit="times the largest rate elsewhere",
    reason="Within what the run has elsewhere a motion without thrust may be one that the water followed otherwise.",
)
LEAP_FOLLOWED = Threshold(
    0.25,
    unit="share of the thrust that the rate promises",
    reason="More of it is a rotor that turned and lost thrust, which is physics.",
    evidence=(
        "The tank's run at -2 V (docs/howto/real-recordings.md) has 19.6 rev/s for 0.4 s before it starts, where "
        "thrust and torque show nothing: cavitation that takes 320 % of the thrust was named for it."
    ),
)
LEAP_COLOURED = Threshold(
    3.0,
    unit="times the error of a mean over samples whose noise is independent",
    reason="Noise of a stand comes again from sample to sample.",
)
CHANNEL_CELLS = Count(
    8,
    unit="cells",
    reason="A channel with fewer values over a run is not judged.",
)
DRIVEN_LEVEL = Threshold(
    0.15,
    unit="share of the largest driver",
    reason="Above it a level counts as driven: below, friction and tares decide what a channel does.",
)
FOLLOWS_LAW = Threshold(
    0.9,
    unit="R^2",
    reason="A channel that a law explains so well follows it.",
)
UNIT_FACTOR_NEAR = Threshold(
    0.03,
    unit="share of the factor",
    reason="A factor so near to one between units is that of these units: a calibration may be off by some per cent.",
)
SCALE_FACTOR = Threshold(
    3.0,
    unit="ratio",
    reason="A factor beyond this, or below its inverse, is no physics of a thruster even where no unit explains it.",
)
NAMED_SCALE_FACTOR = Threshold(
    1.7,
    unit="ratio",
    reason="A factor of units is told from this on: nearer to 1 a change of the supply or the water does it.",
)
SCALE_SCATTER = Threshold(
    0.1,
    unit="share of the factor's logarithm",
    reason="A change of scale is the same over all blocks after it; what scatters more is physics.",
)
SCALE_CHANGE_CELLS = Count(
    3,
    unit="cells",
    reason="On either side of a change of scale these are not used: they may hold rows of both sides.",
)
FASTEST_ROTATION = Threshold(
    1000.0,
    unit="rev/s",
    reason="No propeller turns faster: these are turns per minute.",
)
UNSIGNED_SLOPES = Threshold(
    0.3,
    unit="ratio of the slopes on both sides",
    reason=(
        "A channel without sign goes the same way on both sides of the driver, and on the lesser at least by "
        "this much: less is the offset of a channel rather than a lost sign."
    ),
)
STRANGE_TO_LAW = Threshold(
    0.6,
    unit="R^2",
    reason="A channel that a law explains to less does not follow it: between this and FOLLOWS_LAW nothing is said.",
)
OTHER_LAW_VARIANCE = Threshold(
    0.25,
    unit="ratio of residual variances",
    reason=(
        "One law beats another plainly where it leaves a quarter of the variance: an exponent or a dead band does less."
    ),
)
FASTEST_FLOW = Threshold(
    12.0,
    unit="m/s",
    reason="No towing or circulating tank reaches more.",
)
STUCK_LAW = Threshold(
    0.95,
    unit="R^2",
    reason="A law of one shape that explains so much of a channel is believed beyond the levels that were seen.",
)
ODD_LAW = Threshold(
    0.5,
    unit="R^2",
    reason=(
        "A channel that a free shape over the driver explains to less than half follows something else, and "
        "is not judged by it."
    ),
)
BOTH_WAYS_SHARE = Threshold(
    0.05,
    unit="share of the cells",
    reason="With less of a run in either direction nothing is said of signs.",
)
EVEN_LAW = Threshold(
    0.7,
    unit="R^2",
    reason="A channel that an even shape over the driver explains so well looks like the size of something.",
)
OTHER_RUNS_AGREE = Threshold(
    0.3,
    unit="share of its value",
    reason="A supply or a temperature that was exchanged is, put back, as near as this to that of the other run.",
)
MILLIVOLTS_RATIO = Threshold(
    300.0,
    unit="ratio to the command",
    reason="A voltage so many times the command is in millivolts: no drive or supply has such a ratio.",
)
KILOVOLTS_RATIO = Threshold(
    0.01,
    unit="ratio to the command",
    reason="A voltage so small a part of the command is in kilovolts.",
)
SIZE_AT_REST = Threshold(
    0.1,
    unit="share of the channel's range",
    reason="What looks like the size of something begins at about nothing.",
)
BUS_BELOW_COMMAND = Threshold(
    0.3,
    unit="share of the largest command",
    reason="A bus voltage that never reaches this part of the command drives nothing: it is no bus.",
)
MEASURED_ROWS_MOVE = Threshold(
    0.9,
    unit="share of the rows",
    reason="A measurement hardly ever repeats a value, so more of its rows than this are new.",
)
COMMAND_REST_SCATTER = Threshold(
    0.3,
    unit="ratio to the mean time between changes",
    reason="A command rests for very different times at its levels.",
)
RELATION_STEADY = Threshold(
    0.02,
    unit="share of the range, per cell",
    reason="A channel that moves faster than this counts less in what goes with it: what is behind it lags.",
)
RELATION_SPREAD = Threshold(
    0.2,
    unit="ratio of standard deviations",
    reason="Two runs that share less than this of a channel's range say nothing of a factor between them.",
)
RUN_TO_RUN = Threshold(
    0.02,
    unit="standard deviation of a logarithm",
    reason=(
        "What heat, recirculation, lag and another plan make of the ratio of two voltages or rates from run to "
        "run at the same values of the one; of currents and forces, their squares, twice as much."
    ),
)
RUN_TO_RUN_DEGREES = Count(
    8,
    unit="degrees of freedom",
    reason="How well that variation is known, as the degrees of freedom of Student's law: thrusters differ in it.",
)
CHANGED_FACTOR = Threshold(
    1.1,
    unit="ratio",
    reason=(
        "A command, voltage or rate that is another by less is physics from run to run, a current or torque by "
        "less than its square; of the thrust NAMED_SCALE_FACTOR counts."
    ),
)
EXCHANGED_AGREE = Threshold(
    4.0,
    unit="standard deviations",
    reason=(
        "Two channels were exchanged where, put back, nothing is farther than this from the other run: a tenth of "
        "a rate, a fifth of a force, dynamics and all."
    ),
)
STRANGE_ALONE = Threshold(
    0.5,
    unit="R^2",
    reason=(
        "Of a single run: a channel that the others explain to less than half where they explain one another "
        "follows something else."
    ),
)
STILL_FOLLOWS = Threshold(
    0.8,
    unit="R^2",
    reason=(
        "A channel that another explains to less than this, where it did so well in a sound run, has no factor "
        "any more."
    ),
)
SCATTER_RUN_TO_RUN = Threshold(
    3.0,
    unit="ratio of variances",
    reason=(
        "What is left of a channel may be so much louder in one run than in another before it counts as followed less."
    ),
)
SCATTER_ALLOWED = Threshold(
    0.01,
    unit="share of the variance",
    reason="Of what follows so well that next to nothing is left, as much may be left in another run, three times.",
)
RELATION_APART = Threshold(
    3.0,
    unit="standard deviations",
    reason=(
        "Runs whose channels all go together within this are not looked at any further: a sound pair of runs is "
        "beyond it in one of twenty."
    ),
)
EXCHANGED_BETTER = Threshold(
    0.5,
    unit="ratio",
    reason=(
        "An exchange must leave half of the misfit that one changed channel leaves, or a sound run would be "
        "exchanged with itself."
    ),
)
RANGE_OF_FIGURES = Threshold(
    30.0,
    unit="ratio",
    reason=(
        "Figures of channels in SI units lie within so much of one another either way: how likely two fit into "
        "each other's places by chance."
    ),
)
UNIT_BETWEEN_RUNS = Threshold(
    0.12,
    unit="logarithm of a ratio",
    reason=(
        "A factor between runs so near to that of a unit is taken for it: the units of a quantity lie farther "
        "apart, and the thrust constant may differ by some per cent beside it."
    ),
)
