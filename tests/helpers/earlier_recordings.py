"""Recordings as earlier versions of Underfoot wrote them."""

import sqlite3
from contextlib import closing

import numpy as np

from underfoot.records.recording import Recording

_ALL_TILES = "create table vibration (first integer primary key, count integer not null, data blob not null)"


def make_earlier(path, version):
    """Turn a recording into one of an earlier version, with what that one stored."""
    with Recording(path) as recording:
        blocks = list(recording.blocks("vibration"))
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("drop table vibration")
        base.execute(_ALL_TILES)
        rows = [(first, len(frames), np.ascontiguousarray(frames).tobytes()) for first, frames in blocks]
        base.executemany("insert into vibration values (?, ?, ?)", rows)
        missing = ("envelope", "mark") * (version < 3) + ("commanded", "measured") * (version < 2)
        for table in missing:
            base.execute(f"drop table {table}")
        base.execute(f"pragma user_version = {version}")
