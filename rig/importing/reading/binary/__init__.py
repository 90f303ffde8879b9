"""Logs that are no text, as the same tables of named columns: one file a format, each behind its library."""
