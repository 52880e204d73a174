"""Real time, in its own process; and the same, offline."""
