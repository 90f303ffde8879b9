"""Other ways to the inertia, for comparison: the thesis names Kalman filters and simulated annealing (section 4.2)."""

from identification.comparators.annealing import by_annealing
from identification.comparators.kalman import Smoothing, by_kalman, smooth

__all__ = ["Smoothing", "by_annealing", "by_kalman", "smooth"]
