"""What measurements say of a tile: curves, corrections, responses, and whether they can be right."""
