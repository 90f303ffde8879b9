"""The screen of a calibration with dead weights: what to hang, what the cell reads, what does not go with the rest."""
