"""Stick-slip as first passage (chapter 8): `distribution` has the functions that a script calls."""
