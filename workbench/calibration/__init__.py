"""Calibrations of a tile: readings to newtons, newtons to positions, and signals to accelerations.

`procedures` declares them, a file each (`declaration`); `science` evaluates measurements, `results` turns them into
text, pictures and a profile, `rigs` press the tile, and `files` reads measurements and writes reports.
"""
