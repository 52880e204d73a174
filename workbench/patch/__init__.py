"""Patches: node declarations, the document, and the program compiled from it."""
