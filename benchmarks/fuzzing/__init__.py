"""Input that nobody sane would send, into every place that takes input; out comes what was hurt by it."""
