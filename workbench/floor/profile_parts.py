"""The parts of a profile."""

PARTS = {"fsr": "Forces", "centroid": "Places", "response": "Vibration", "latency": "Latency", "plate": "Stiffness"}
"""What people call the calibration that makes a part, by the part's name in files and commands."""
