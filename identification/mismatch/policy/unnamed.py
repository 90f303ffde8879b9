"""Thresholds: when a shape or a formula without a name is told."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

FLEXIBLE_TERMS = Count(
    3,
    unit="terms",
    reason=(
        "After three splines over different covariates what is left is not of one covariate, and a fourth "
        "would follow noise."
    ),
)
CHANCE_BESIDE_REST = Threshold(
    0.01,
    unit="probability",
    reason=(
        "Of a name where something is left: it may follow that, and noise makes as much in one search of a hundred. "
        "Alone it is believed by its BIC."
    ),
    evidence=(
        "docs/howto/real-recordings.md, tank, +2 V: a linear term (p 0.04) and a skew of 3 ms (p 0.05) stood beside a "
        "rest of 73 %, and took 0.0003 N off what was not fitted."
    ),
)
COVARIATES_EQUAL_BIC = Threshold(
    10.0,
    unit="BIC",
    reason=(
        "Two covariates whose splines differ by less do equally well, and the one that claims less is told "
        "with the other beside it."
    ),
    evidence=(
        "Kass and Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773: twice the log of a Bayes factor "
        "of 6 to 10 is strong, above 10 very strong."
    ),
)
MONOTONE_CORRELATION = Threshold(
    0.9,
    unit="rank correlation with time",
    reason="A recorded quantity that goes one way only, but for its noise, is time by another name.",
)
LOCATED_GAIN = Threshold(
    0.8,
    unit="share of the best covariate's gain",
    reason=(
        "The covariate over which the residual was located is kept while its spline gains nearly as much as the best."
    ),
)
SHAPE_INSTEAD_OF_NAMES_RMSE = Threshold(
    1.02,
    unit="ratio of held-out RMSE",
    reason=(
        "A shape that claims nothing takes the place of terms whose name was not earned where it predicts "
        "about as well: two per cent worse is still the more honest model."
    ),
)
FORMULAS_EQUAL_BIC = Threshold(
    9.0,
    unit="BIC",
    reason="Formulas nearer to the best are equally good, and the plainest is told.",
    evidence=(
        "Kass and Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773: twice the log of a Bayes factor "
        "of 6 to 10 is strong, above 10 very strong."
    ),
)
FORMULA_GAIN_BIC = Threshold(
    20.0,
    unit="BIC",
    reason=(
        "Thousands of products of powers are tried, so a formula must gain twice what is very strong evidence "
        "for one model alone."
    ),
    evidence=(
        "Kass and Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773: twice the log of a Bayes factor "
        "of 6 to 10 is strong, above 10 very strong."
    ),
)
FORMULA_PREDICTS = Threshold(
    0.85,
    unit="share of the free curves' fall of the held-out chi-square",
    reason=(
        "A formula is told only where it predicts nearly as well as the free shape: else it is a part of the "
        "truth at best."
    ),
)
FORMULA_HALVES_P = Threshold(
    0.01,
    unit="probability",
    reason="Coefficients that differ so much between the halves are no law of the whole run.",
)
BROKEN_LINE_BIC = Threshold(
    10.0,
    unit="BIC",
    reason="A broken line must be better by so much to be preferred to a cubic: most physics has no kinks.",
    evidence=(
        "Kass and Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773: twice the log of a Bayes factor "
        "of 6 to 10 is strong, above 10 very strong."
    ),
)
MOSTLY_APART = Threshold(
    0.3,
    unit="share of the parameter",
    reason="A parameter that differs more between halves, directions or levels is another thing in each of them.",
)
MOSTLY_SHARE = Threshold(
    0.8,
    unit="share of the squared error that could be taken off what was not fitted",
    reason="A name whose shape is not quite the textbook's is said where it makes most of what any shape could.",
)
ALL_SHARE = Threshold(
    0.95,
    unit="share of the squared error that could be taken off what was not fitted",
    reason="Less than a twentieth left beside a name is nothing that a person would look for.",
)
TOLD_APART = Threshold(
    0.5,
    unit="share of the larger amount",
    reason=(
        "A name is earned beside the terms that have none, and told without them: where its amount is another by half, "
        "it mended one of them."
    ),
)
TOLD_SIGMA = Threshold(
    3.0,
    unit="sigma",
    reason="Both amounts have errors of their own.",
)
FOLLOWED_NOISE = Threshold(
    0.1,
    unit="chi-square a sample, in units of what is left",
    reason=(
        "Terms without a name that took more than this of every sample did not follow noise: a residual that is large "
        "everywhere has no place that stands out of draws of itself."
    ),
    evidence=(
        "A motor that loses 60 % in its winding, without rate: 3.3 N of a winding loss and an exponent were called "
        "noise beside 0.09 N (tests/identification/mismatch/unnamed/test_large_everywhere.py)."
    ),
)
