"""Devices: the sources of force and the outputs for vibration."""
