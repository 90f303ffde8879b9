"""Thresholds: when what was not fitted is predicted better."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Threshold

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
)
RUNS_ALIKE = Threshold(
    0.5,
    unit="share of the largest driver and of the median samples",
    reason=(
        "A run with less tells too little to judge a model of the others, or to be judged by one: then blocks "
        "of time judge."
    ),
)
