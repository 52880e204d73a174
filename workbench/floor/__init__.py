"""The instrumented floor: its tiles, the forces on them, the contacts in those forces, and the steps."""
