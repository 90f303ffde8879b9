"""In: keys. Out: what stood on the screen, and what the motor did."""
