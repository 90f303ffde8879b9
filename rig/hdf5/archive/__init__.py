"""Packed copies: smaller, checked, and quick to read in part."""
