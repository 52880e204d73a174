"""Signals and random numbers by position: noise, tones, envelopes, rhythms, and counter-based random draws."""
