"""What Underfoot begins with: patches, floors and simulated tiles, a JSON file each."""
