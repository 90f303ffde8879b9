"""Terms of a model that claim no physics: splines over a covariate, and formulas."""
