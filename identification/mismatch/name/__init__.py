"""From chosen terms to names that are earned, or unearned with the reason."""
