"""Other people's ways of finding what a model leaves out, on the recordings and candidate columns that ours has."""
