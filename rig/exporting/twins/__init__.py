"""A twin as what simulators, autopilots and programs read: one file a kind of consumer, over one sampled curve."""
