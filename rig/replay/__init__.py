"""`rig replay`: what was captured plays again, at any speed."""
