"""Stick-slip as a first-passage problem (chapter 8): `slip_distribution.SlipDistribution` for scripts."""
