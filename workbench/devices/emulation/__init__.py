"""Emulation of a tile's firmware, with faults of real lines on request."""
