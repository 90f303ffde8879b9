"""From what a model leaves to the covariates over which it has structure."""
