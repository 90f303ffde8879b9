"""Thresholds: whether a simulation may be compared with a recording."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Threshold

COMMANDS_DIFFER = Threshold(
    0.02,
    unit="share of the largest driver",
    reason="Commands that differ by more are two: rounding and quanta are smaller.",
)
COMMANDS_DIFFER_TIME = Threshold(
    0.02,
    unit="share of the time",
    reason="For so long they may differ, round steps: a simulation of another plan is refused.",
)
CLOCKS_DIFFER = Threshold(
    0.1,
    unit="s",
    reason="A difference shorter than this is a matter of clocks, and not what a refusal should show.",
)
NOISY_SIMULATION = Threshold(
    0.3,
    unit="share of the real noise",
    reason=(
        "A simulation with more noise is not subtracted sample by sample where it is well described: its "
        "noise would be added to the recording's."
    ),
)
SIMULATION_COVERS = Threshold(
    0.9,
    unit="share of the real thrust samples",
    reason="A simulation that covers less is refused: the rest would be judged against nothing.",
)
FORM_ERROR = Threshold(
    0.01,
    unit="share of what a term changes",
    reason=(
        "A twin's textbook forms are taken to be off by so much in another run, in size and towards each other form "
        "of the same effect: what its own run could not tell shows where the plan is another. In size a form is off by "
        "no more than its own run could tell of its amount if all else were known."
    ),
    evidence=(
        "A lag fitted as mixed where it was quadratic left a dead band of 9.6 sigma in a staircase after random levels "
        "(field case 3 of the lane `difference` before this). With a share for effects of one form too, asymmetry of "
        "30 % hid a torque cross-talk of 15 sigma (difference/one_more/2 of draw 2027-01-03). With all of a hundredth "
        "for effects of several forms, dead band, winding and lag hid an exponent of 15 sigma, 13 of which an oracle "
        "still sees that has to learn all amounts from both runs (one_more/1 of draw 2036-04-01)."
    ),
)
FORM_ERROR_SIGMA = Threshold(
    3.0,
    unit="sigma in the twin's own run",
    reason="Another form that lost no more there was not told from the one that was chosen.",
)
TWIN_SHAPE_ERROR = Threshold(
    0.001,
    unit="share of what a term of the twin changes",
    reason=(
        "No textbook shape holds from one plan to another to more than a part in a thousand: so much of what the "
        "twin's terms change may be left, anywhere they change something, before something unknown is said to be left. "
        "A term that is found in the run itself is spared thirty times as much, and so was the twin's in its own run."
    ),
    evidence=(
        "difference/nothing of draw 2027-03-05 (token 71d4ea84c2): beside an asymmetry of 13,848 sigma and a "
        "winding of 10,399 a residual of 59 with 24 degrees of freedom, p = 0.0007, was `unexplained` where nothing "
        "had changed."
    ),
)
SIGNATURE_THRUST = Threshold(
    0.02,
    unit="share of the largest change or thrust",
    reason="A smaller thrust tells nothing of a share of it.",
)
TOLD_FROM_BEFORE = Threshold(
    9.0,
    unit="chi-square",
    reason=(
        "Whether a thruster had what is found already when the twin's recordings were made is told at odds of 90 to 1 "
        "(half of it is their logarithm); with less it is said that those could not have shown it."
    ),
    evidence=(
        "difference/one_more/9 of draw 2026-12-30 has levels between 0.49 and 0.61 V in the second run alone: its jump "
        "at 0.613 V (truth 0.619) stood beside the twin's 0.486 +- 0.056 V as if it had been added."
    ),
)
