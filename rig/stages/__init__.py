"""From a campaign to finished recordings: the controller process, its stages one after another."""
