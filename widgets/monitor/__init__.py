"""The Monitor workspace: the floor from above, forces, vibration and footsteps, live."""
