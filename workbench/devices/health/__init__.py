"""Detection of sensor faults from readings."""
