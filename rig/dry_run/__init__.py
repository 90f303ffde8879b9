"""What a campaign will do, before anything is opened: command over time, times at each level, thrust, energy."""
