"""Rigs: a simulated hand, or a device with a load cell."""
