"""What presses or shakes a tile while it is calibrated: a simulated hand, or a device with a load cell."""
