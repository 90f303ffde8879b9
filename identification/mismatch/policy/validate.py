"""Thresholds: when what was not fitted is predicted better."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

HELD_OUT_WORTH = Threshold(
    6.0,
    unit="chi-square",
    reason=(
        "Terms without a name must pay on what was not fitted: chi-square must fall by this beside 2 for each "
        "parameter, for the best of several shapes was picked."
    ),
    evidence="2 for each parameter: Akaike, IEEE Trans. Autom. Control 19 (1974) 716.",
)
HELD_OUT_RMSE_SLACK = Threshold(
    1.002,
    unit="ratio of RMSE",
    reason=(
        "RMSE may grow by this where chi-square falls: the loudest noise weighs most in it, and is no reason "
        "to refuse a better model."
    ),
)
PREDICTED_WORSE_CHI2 = Threshold(
    9.0,
    unit="chi-square",
    reason=(
        "A name is doubted where the model predicts what was not fitted better without it, by three sigma of "
        "one parameter."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases none are answered otherwise at half or double of it.",
)
CHANGE_WORTH_CHI2 = Threshold(
    4.0,
    unit="chi-square",
    reason=(
        "Another amount of what a twin has is told as a change where what was not fitted is predicted better with it, "
        "by two sigma of one parameter: what a new effect leaves is taken up by amounts that were there before it."
    ),
    evidence=(
        "Lane difference, draws 2035-03-01 and 2035-06-01: a dead band (2.6) beside a creep that the catalogue holds "
        "in part, a heating (1.0) beside a winding loss, neither changed; effects that were new 9.7 and 47. A change "
        "of 15 sigma is worth some 56 on a quarter of a run."
    ),
)
GROWN_P = Threshold(
    0.01,
    unit="probability",
    reason=(
        "A model whose error on what was not fitted is larger than the baseline's, as chance would make it once in a "
        "hundred recordings, explains nothing: it describes the runs that it was fitted to."
    ),
)
GROWN_RATIO = Threshold(
    1.05,
    unit="ratio of RMSE on what was not fitted",
    reason=(
        "An error that grew by a twentieth is no chance, however few and uneven the blocks are over which it is "
        "compared: a parameter too many costs some thousandths."
    ),
)
EXPLAINED_NOISE = Threshold(
    3.0,
    unit="ratio of RMSE on what was not fitted to the noise of a sample",
    reason=(
        "An error of so many times the noise is no noise, whatever law of slow noise or of noise after steps the "
        "fitted samples were judged by: it is not explained."
    ),
    evidence=(
        "docs/proof.md: of 50 cases of the bench the largest ratio of an answer that is right and alone is 1.7; "
        "benchmarks/diagnosis/small_motor.py: wrong `explained` answers had 6.4 and 45."
    ),
)
LEAST_BLOCKS = Count(
    4,
    unit="blocks of time",
    reason="Over fewer blocks the scatter of a difference of errors is not known, and none is called a growth.",
)
RUNS_ALIKE = Threshold(
    0.5,
    unit="share of the largest driver and of the median samples",
    reason=(
        "A run with less tells too little to judge a model of the others, or to be judged by one: then blocks "
        "of time judge."
    ),
)
