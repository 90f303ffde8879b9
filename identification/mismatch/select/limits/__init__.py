"""What clips: a fitted limit in, what else was recorded that stops with it or goes on beyond it out."""
