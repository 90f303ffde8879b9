"""Mathematics: arrays in, verdicts out. No files, wires, clocks or threads."""
