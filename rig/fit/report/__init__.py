"""From the answer of `rig fit` to its page."""
