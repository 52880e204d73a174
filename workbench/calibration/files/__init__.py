"""Files of measurements and reports."""
