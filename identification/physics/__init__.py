"""What `tau = C V|V|` may leave out: one effect a file, in the textbook forms that the field has."""
