"""The window's side of a session: target, controller, the open patch, settings, and reports as signals."""
