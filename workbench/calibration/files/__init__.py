"""Measurements and reports on disk."""
