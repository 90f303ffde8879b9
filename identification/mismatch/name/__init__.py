"""From chosen terms to names that are earned, or doubted with the reason."""
