"""From arrays and sentences to one HTML page: its parts, its style, and the figures that several pages draw."""
