"""Calibrations of a tile: readings to newtons, newtons to places, and signals to accelerations.

`procedures` declares them, a file each (`declaration`); `science` computes what measurements say, `results` puts it
into words, pictures and a profile, `rigs` press the tile, and `files` reads measurements and writes reports.
"""
