"""A recording that is written counts as used for other programs, whatever else here looks at its file."""

import subprocess
import sys
from contextlib import closing

from made_recordings import ABOUT

from underfoot.documents import document_format
from underfoot.records.recording import Recording, is_recording
from underfoot.records.recording_writer import Writer

# What a program does that gives the recording another name: all of the log goes into the file, and the log away.
PUTS_LOG_AWAY = """
import sqlite3, sys
try:
    print(sqlite3.connect(sys.argv[1], timeout=0.0).execute("pragma journal_mode = delete").fetchone()[0])
except sqlite3.OperationalError as error:
    print(error)
"""


def test_a_file_whose_kind_is_asked_for_keeps_the_locks_of_who_reads_it(tmp_path):
    path = tmp_path / "walk.underfoot"

    def put_away():
        return subprocess.run([sys.executable, "-c", PUTS_LOG_AWAY, path], capture_output=True, text=True).stdout

    with closing(Writer(path, ABOUT)) as writer, Recording(path) as recording:
        writer.commit()
        recording.add_mark(0, "while it is written")
        assert (is_recording(path), document_format(path)) == (True, "")
        assert put_away() == "database is locked\n"
    assert put_away() == "delete\n"
