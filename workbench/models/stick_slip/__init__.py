"""Stick-slip as a first-passage problem (chapter 8); `distribution` has the functions for scripts."""
