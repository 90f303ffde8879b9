"""Captures: a device or bus goes in, its bytes with their times come out as a file; and the way back to rows."""
