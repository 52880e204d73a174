"""What a tile is made of: plate, suspension, shaker, sensors, and all of them as one body."""
