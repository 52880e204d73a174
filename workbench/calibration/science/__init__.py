"""Evaluation of measurements on a tile: curves, corrections, responses, and plausibility checks."""
