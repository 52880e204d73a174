"""Results of each calibration: figures, verdict, warnings, pictures, raw data, and the profile's part."""
