"""Readings at known loads in; the curve of a load cell with its covariance, its budget, and the wrong weight out."""
