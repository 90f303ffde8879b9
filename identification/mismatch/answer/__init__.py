"""From all that was found to the verdict, in words and as JSON."""
