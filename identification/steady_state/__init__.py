"""From a recorded run to points: one per hold, each with a standard error that can be believed."""
