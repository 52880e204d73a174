"""The window's plots, live or still."""
