"""The real-time engine, which runs in its own process, and the same engine offline."""
