"""What is true of a case: effects, plans, lies and a generator go in; frozen data and noise-free thrust come out."""
