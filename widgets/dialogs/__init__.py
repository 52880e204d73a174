"""Dialogs: the sound card, the transport that tiles are on, and the keys."""
