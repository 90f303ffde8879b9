"""From rows of a regression and what is known of their errors to parameters, their covariance and verdicts."""
