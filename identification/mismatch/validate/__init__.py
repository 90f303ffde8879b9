"""From a model to its score on what it was not fitted to: blocks of time, or whole runs."""
