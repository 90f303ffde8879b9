"""From terms and their parameters to the prediction of a run, at its intervals and between ticks of its command."""
