"""From a diagnosis to its page: words and figures, for a thruster and for a vehicle."""
