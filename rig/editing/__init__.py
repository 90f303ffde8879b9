"""A campaign file under a person's hands: its keys as text, changes that keep all else as written, saving it."""
