"""A plug-in of Underfoot."""
