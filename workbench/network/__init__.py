"""Contacts, steps and health for other programs, and cues from them: TUIO, OSC, LSL (docs/network.md)."""
