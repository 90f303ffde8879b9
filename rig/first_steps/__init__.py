"""A folder to begin with: an empty one in, a bench, its simulated world and a campaign out, to be edited."""
