"""What the readings say about the sensors themselves."""
