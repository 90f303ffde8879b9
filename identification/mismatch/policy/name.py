"""Thresholds: when the name of a term is earned."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

PART_DIFFERENCE = Threshold(
    0.1,
    unit="share of the parameter",
    reason=(
        "Halves, directions, levels or runs whose parameters differ by less count as the same: textbook "
        "shapes are not truer than that."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases 1 is answered otherwise at half or double of it.",
)
PART_SIZE = Threshold(
    0.1,
    unit="share of the size of what a term does",
    reason="With less of a term on one side of a split there is nothing to compare.",
)
OWN_COVARIATE_SHARE = Threshold(
    0.01,
    unit="share of what a term explains",
    reason="Less than this left over a term's own covariate is the textbook's fault, not the name's.",
)
INCONSTANT_P = Threshold(
    1e-3,
    unit="probability",
    reason=(
        "A parameter that is not the same everywhere costs the name, so noise must make such a difference, "
        "after all tests of a term, once in a thousand."
    ),
    evidence=(
        "docs/proof.md: of 344 plain effects whose nearest neighbour leaves an oracle 8 sigma 98.5 % are "
        "right alone, so that the checks cost few names."
    ),
)
OWN_COVARIATE_P = Threshold(
    1e-4,
    unit="probability",
    reason=(
        "What is left over a term's own covariate says that the shape is another one, if it is plainer than "
        "what is called structure at all."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases none are answered otherwise at half or double of it.",
)
CANCELLED_SHARE = Threshold(
    0.15,
    unit="share of what the lesser of two terms does alone",
    reason="Two terms that leave less together cancel: a large lag with a large lead, and neither is seen.",
)
CURVE_OF_ANY_SHAPE_TERMS = Count(
    3,
    unit="terms",
    reason=(
        "So many shapes on one static curve make any curve, and no name is earned by one of them; the search "
        "adds one fewer, a swap may add another."
    ),
)
REPAIR_SHARE = Threshold(
    0.1,
    unit="share of what two shapes explain together",
    reason="What adds less than this to the other shape on the same curve only repairs it.",
    evidence="docs/sensitivity.md: of 297 concealed cases none are answered otherwise at half or double of it.",
)
REPAIRED_ALONE_SHARE = Threshold(
    0.7,
    unit="share of what two shapes explain together",
    reason=(
        "Where each of two shapes explains more than this alone, either could be the one that is repaired, "
        "and neither is told."
    ),
)
CLEARLY_BETTER_ALONE = Threshold(
    20.0,
    unit="ratio of chi-squares",
    reason=(
        "Of two shapes on one static curve, each of which alone does nearly all, the one that leaves so many times "
        "less has the curve's shape, and the other repairs a little of it."
    ),
)
RUNS_DIFFER_P = Threshold(
    1e-3,
    unit="probability",
    reason="That single runs want other values is said where noise makes them differ so once in a thousand diagnoses.",
)
RUNS_APART = Threshold(
    0.5,
    unit="share of the median value",
    reason="Values of single runs within such a range are one value to a person, however small their errors are.",
)
PART_SIGMA = Threshold(
    0.3,
    unit="sigma",
    reason="Where the whole effect of a term in one part would be worth less, the parts tell nothing of its constancy.",
)
