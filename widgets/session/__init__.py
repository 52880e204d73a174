"""What binds the window to a session: target, controller, the open patch, settings, and reports as signals."""
