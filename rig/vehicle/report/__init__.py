"""From the answer of `rig vehicle`, or positions of steady runs, to a page."""
