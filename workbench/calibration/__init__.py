"""Procedures that make a tile true: newtons, centimetres, metres a second squared."""
