"""From rivals to the sweep that tells them apart, within the limits of the bench."""
