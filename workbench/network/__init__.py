"""Contacts, steps and health to other programs, and cues from them: TUIO, OSC, LSL (docs/network.md)."""
