"""The outside world: where force comes from and vibration goes."""
