"""Parts of a tile: plate, suspension, shaker, sensors, and their assembly."""
