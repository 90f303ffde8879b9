"""From a residual at full rate to its lines, orders of the rotor and resonances, and the runs without the lines."""
