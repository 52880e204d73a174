"""A tile's firmware without a tile, with the faults of real lines on request."""
