"""What binds the window to a session: target, player, the open patch, settings, and reports as signals."""
