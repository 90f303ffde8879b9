"""From a recording to one figure as a file: thrust with its fit, residuals, or channels over time (`rig plot`)."""
