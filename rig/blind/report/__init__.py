"""From the scores of a blind proof to its page."""
