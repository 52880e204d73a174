"""What is neither code nor preset: firmware of a tile, and pictures for the README (which stay out of the wheel)."""
