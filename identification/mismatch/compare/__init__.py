"""From a saved model or a simulation to a baseline, and from a model to the run that it predicts."""
