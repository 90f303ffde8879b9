"""Figures and reports: reads what identification found, draws with matplotlib into files, never on a screen."""
