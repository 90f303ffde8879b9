"""One term for another: a model and its terms in, the same effects in other forms and rivals refitted out."""
