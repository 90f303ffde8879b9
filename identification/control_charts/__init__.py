"""From one figure of each unit of a production, in order, to the units that left its control limits, and since when."""
