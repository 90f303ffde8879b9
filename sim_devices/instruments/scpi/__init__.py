"""A SCPI bench supply, as it answers lines."""
