"""From an answer and its truth to a score, and from many scores to rates beside their goals. Pure."""
