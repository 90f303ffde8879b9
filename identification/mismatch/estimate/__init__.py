"""From a model and the runs to its best values, the noise beside them, and confidence intervals."""
