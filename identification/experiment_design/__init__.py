"""From what a campaign may cost to the levels, order and times that tell the parameters best."""
