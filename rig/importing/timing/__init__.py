"""From a file's times to those of a recording: its clock, whether its rows are levels, two clocks into one."""
