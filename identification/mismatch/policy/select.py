"""Thresholds: which terms come into the model, and which stay, go or have rivals."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

SCREENING_FALSE_ALARM = Threshold(
    0.01,
    unit="probability",
    reason=(
        "Some term correlates with any noise, so the largest of all trials must be one that noise alone "
        "reaches in one clean recording of a hundred."
    ),
    evidence=(
        "2 of 648 clean recordings of benchmarks/diagnosis/hidden_gains.py pass it; docs/howto/diagnose.md: in the "
        "proof 3 of 1,002 passed it and were given a name."
    ),
)
EARLY_FORCE = Threshold(
    0.25,
    unit="share of the time between two samples",
    reason=(
        "A force that comes so much before its command moves at a sample where the intervals have nothing move: they "
        "are made again, short before steps too."
    ),
    evidence="benchmarks/diagnosis/euler_logs.py: without, a lag of the water or a loss at reversals stood for it.",
)
STILL_FOUND = Threshold(
    0.95,
    unit="times the threshold",
    reason=(
        "A term that the model has is missed where a screening without it nearly finds something: the threshold is a "
        "quantile of a few hundred surrogates, and another computer's last digits move it by so much."
    ),
    evidence=(
        "docs/howto/real-recordings.md, the propeller whose supply sags: 4.49 beside 4.57 dropped the coupling to "
        "the rate on one processor, 4.48 beside 4.45 kept it on another; 0.0111 N and 0.0059 N on data that were not "
        "fitted."
    ),
)
SIMPLER_TERM_GAIN = Threshold(
    0.93,
    unit="share of the best gain",
    reason=(
        "A candidate with fewer parameters that gains nearly as much goes first: the rest of the gain may be "
        "bought by its extra freedom, and swaps come later."
    ),
)
MODEL_TERMS = Count(
    6,
    unit="terms",
    reason=(
        "More than half a dozen effects beside C and the tares are not asked of one recording: what is still "
        "left then has no name."
    ),
)
HIDDEN_SIGMA = Threshold(
    2.0,
    unit="sigma",
    reason=(
        "Where no term passes, one along a slow covariate may have been taken for noise; below two sigma "
        "there is nothing to try."
    ),
    evidence="benchmarks/diagnosis/hidden_gains.py tells the gains from 1.5 sigma on.",
)
HIDDEN_FIRST_TERM_SIGMA = Threshold(
    3.0,
    unit="sigma",
    reason="A first term that is slow only because the plan is must show more clearly, for far more terms may be so.",
)
HIDDEN_TERM_PRICE = Threshold(
    0.5,
    unit="share of the BIC price",
    reason=(
        "A term that is told from noise by estimating both has passed no screening, so half of its "
        "parameters' price is asked beside the family-wise threshold."
    ),
    evidence="benchmarks/diagnosis/hidden_gains.py prints the gains on clean recordings beside what is asked.",
)
HIDDEN_OFFSET_PRICE = Threshold(
    0.35,
    unit="share of the BIC price",
    reason="The price of a jump of the zero, whose instant is one of a few that the data point to and not any.",
    evidence=(
        "benchmarks/diagnosis/hidden_gains.py: of 336 clean recordings one gained more and was named. "
        "docs/howto/diagnose.md: so were 2 of 1,002."
    ),
)
STATIC_CURVE_TERMS = Count(
    2,
    unit="terms",
    reason="Any static curve can be made of enough shapes, so the search adds at most two to one curve.",
)
PLAIN_DIRECTION_SIGMA = Threshold(
    4.0,
    unit="sigma",
    reason=(
        "A direction that stands out so far is taken out before surrogates are drawn and before noise is "
        "estimated, or a mismatch would be taken for noise and hide itself."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases 50 are answered otherwise at half or double of it.",
)
RIVAL_STATED_BIC = Threshold(
    9.0,
    unit="BIC",
    reason=(
        "A rival whose BIC is worse by less is stated beside the name: its odds are above 1 to 90, and the "
        "model errors of both are as large."
    ),
    evidence=(
        "Kass and Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773: twice the log of a Bayes factor "
        "of 6 to 10 is strong, above 10 very strong."
    ),
)
RIVALS_EQUAL_BIC = Threshold(
    4.0,
    unit="BIC",
    reason="Two answers that differ by less are equally good, odds of 7 to 1 or less, and the verdict is ambiguous.",
    evidence=(
        "Kass and Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773: twice the log of a Bayes factor "
        "of 6 to 10 is strong, above 10 very strong."
    ),
)
RARE_TERM_BIC = Threshold(
    8.0,
    unit="BIC",
    reason=(
        "By so much a rare effect (a cell that feels the torque) must do better than an ordinary one of the same shape "
        "(blades that push less one way) to be named before it: odds of 50 to 1 of meeting one or the other."
    ),
    evidence=(
        "docs/proof.md, lane field: of 40 composites 4 that hold an asymmetry were told as torque cross-talk, 2 to 61 "
        "BIC better beside other effects in a wrong form, C 3 to 7 % beside the truth."
    ),
)
RIVAL_REFIT_CHI2 = Threshold(
    40.0,
    unit="chi-square",
    reason=(
        "A rival that loses more by its tangent alone is not refitted: its inner parameters would have to win "
        "all of it back."
    ),
)
PRESSED_TERM_HANDICAP = Threshold(
    0.3,
    unit="share of the term's gain",
    reason=(
        "A term whose parameters end at what is possible explains nothing, so a rival with possible ones may "
        "be worse by this and still takes its place."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases none are answered otherwise at half or double of it.",
)
MERGER_PROMISE = Threshold(
    0.5,
    unit="share of the gain that is needed",
    reason="One term in the place of two is refitted only where its tangent alone promises half of what it must gain.",
)
RIVAL_BETTER_BIC = Threshold(
    0.5,
    unit="BIC",
    reason=(
        "A rival takes the place only where it is better by more than the rounding of two fits, or two models "
        "would take turns."
    ),
)
SHAPE_ERROR = Threshold(
    0.03,
    unit="share of a term's own correction",
    reason=(
        "A textbook shape is trusted to a few per cent of what it corrects before something unknown is said "
        "to be left, else every real recording would end unexplained."
    ),
    evidence="docs/howto/real-recordings.md: recordings of others are more often unexplained than not even so.",
)
NEXT_TERM_SHAPE_ERROR = Threshold(
    0.006,
    unit="share of a term's own correction",
    reason=(
        "The same before another term of the catalogue is added: its shape is known, so that a fifth as much "
        "is put down to it."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases none are answered otherwise at half or double of it.",
)
CLIPPED_DEPTH = Threshold(
    1.0,
    unit="sigma of the noise",
    reason=(
        "Readings are judged for flatness only this far beyond a limit, where a cell that clips leaves less "
        "than a tenth of the variance."
    ),
    evidence="The lesser of a normal deviate and one standard deviation below its mean has a variance of 0.07.",
)
KNEE_SLOPE = Threshold(
    0.8,
    unit="slope",
    reason="Of a knee only readings where it is bent plainly are judged: nearer to 1 the noise is hardly smaller.",
)
CLIPPED_VARIANCE_MISSING = Threshold(
    0.5,
    unit="share of the variance said to be missing",
    reason=(
        "Readings that keep more than half of the variance that a limit would take are not flat: no limit took them."
    ),
)
CLIPPED_VARIANCE_SIGMA = Threshold(
    3.0,
    unit="sigma",
    reason=(
        "The variance must be told from that of flat readings by three standard errors before a limit is "
        "refused for it."
    ),
)
CLIPPED_SAMPLES = Count(
    10,
    unit="samples",
    reason="A variance of fewer samples tells nothing of flatness: its own standard error is half of it.",
)
GOES_ON_SIGMA = Threshold(
    3.0,
    unit="sigma",
    reason=(
        "Current or rate place a saturation only where they differ by three standard errors from half-way between "
        "clipping with it and going on as below it."
    ),
)
GOES_ON_SETTLED = Threshold(
    0.5,
    unit="s",
    reason="Sooner after a step current and rate are on their way: a motor's peak of current would be a rise.",
)
GOES_ON_DEPTH = Threshold(
    0.01,
    unit="share of what is asked",
    reason="Nearer to a limit than this its own error decides on which side a row is.",
)
GOES_ON_BELOW = Threshold(
    0.25,
    unit="share of the limit",
    reason="Below a limit a quantity is followed over its last part only: a straight line holds over no more.",
)
GOES_ON_ROWS = Count(
    10,
    unit="rows",
    reason="Fewer rows on either side of a limit tell neither a rise nor its error.",
)
ALIAS_LOSS = Threshold(
    4.0,
    unit="chi-square",
    reason=(
        "A model that loses less by ringing at a frequency that the samples can show is as good: two sigma of "
        "one parameter."
    ),
)
CLOCK_DIFFERENCE = Threshold(
    0.001,
    unit="s",
    reason=(
        "Clocks of two devices are not trusted to agree better than a millisecond, so a delay up to it is a "
        "nuisance and no finding, unless stamps are dense and even."
    ),
)
STATED_DELAY_SIGMA = Threshold(
    3.0,
    unit="standard deviations",
    reason="A delay that is stated with its error may be off by this much of it, which is fitted and no finding.",
)
PLAIN_JUMP_SIGMA = Threshold(
    5.0,
    unit="sigma",
    reason=(
        "A jump of the zero of this size is no noise although hundreds of instants were looked at, and must "
        "not be taken for it when noise is estimated."
    ),
)
DIRECTION_DRIVER = Threshold(
    0.02,
    unit="share of the largest driver",
    reason="Below it a driver has no direction: noise and tares of a command decide its sign.",
)
JUMPS_APART = Threshold(
    0.02,
    unit="share of the longest run",
    reason="Two jumps nearer to each other are told as one: between them there is too little to tell two levels.",
)
KEPT_TERM_FALSE_ALARM = Threshold(
    2e-4,
    unit="probability",
    reason=(
        "A term stays only while the model loses more without it than noise would give its parameters, fifty "
        "times rarer than a term may be found by noise, for it was picked as the best of some fifty trials."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases none are answered otherwise at half or double of it.",
)
FIRST_COME_CHI2 = Threshold(
    25.0,
    unit="chi-square",
    reason=(
        "Of a term that others have overtaken no more may be left where it is dropped because no search would find it "
        "beside them: what they may leave behind by their shape is not counted there, and a term of five sigma is seen."
    ),
    evidence=(
        "`make demo`, once of ten: a rotation coupling of 3.8 sigma, taken first for 932, beside the motor lag; the "
        "screening without it counts 0."
    ),
)
OVERTAKEN = Threshold(
    0.25,
    unit="share of the fall of chi-square",
    reason=(
        "A term that is worth less now than this part of what it gained when it was taken was taken for what others "
        "tell since: whether they would tell all of it is asked by a search without it."
    ),
    evidence=(
        "difference/one_more/9 of draw 2031-06-01, the first run (winding loss, lag, asymmetry and inflow): a stand "
        "that rings at 0.6 Hz gained 882, was worth 81 in the end, and a winding loss of 50 sigma was missed; without "
        "it the search finds all four, BIC better by 202."
    ),
)
MANY_SIDED = Count(
    3,
    unit="parameters",
    reason=(
        "A term of so many parameters can be like several effects at once. Where it was taken and something is left "
        "that no term may take, a search without it is asked whether it was."
    ),
    evidence=(
        "difference/nothing/11 of draw 2038-12-01, the first run (dead band, winding loss, asymmetry, inflow, "
        "recirculation): a heating of winding and magnet and a stand of 0.6 Hz, with 38 sigma left beside them; "
        "without both the search finds the five and leaves nothing, -2 log likelihood less by 14,000."
    ),
)
STEADY_TERM_FALSE_ALARM = Threshold(
    5e-4,
    unit="probability",
    reason=(
        "A term of one shape, for which no instant or place is looked for, pays for itself alone when it is "
        "told from noise by estimating both."
    ),
    evidence=(
        "benchmarks/diagnosis/hidden_gains.py: on 336 clean recordings of six kinds of noise the largest gain was "
        "11.3; of a drift that an oracle sees at 8 sigma half gain more than 15. docs/howto/diagnose.md: 1 of 1,002 "
        "clean recordings was given a drift."
    ),
)
CANDIDATE_SIGMA_SHARE = Threshold(
    0.5,
    unit="share of the largest sigma",
    reason=(
        "A term whose best trial is worth less than half the sigma of the best term is no candidate of this "
        "round: after the best is in, it is screened again."
    ),
)
RIVAL_REFIT_LIKENESS = Threshold(
    0.9,
    unit="correlation",
    reason="A rival whose change is so like that of the term is refitted whatever it loses by its tangent.",
)
RATE_ROWS = Count(
    20,
    unit="rows",
    reason="With fewer rows of it in a run a rate is no response of its own: neither its noise nor scale is known.",
)
