"""Things that are struck: modal objects, and hammers that hit them."""

MODES = (("frequency Hz", 1.0, 20_000.0), ("decay 1/s", 0.1, 10_000.0), ("amplitude", -100.0, 100.0))
