"""A process of a session that is busy: it looks at its messages only once something is written to a named pipe."""

from pathlib import Path


def run(connection, gate):
    """Wait, then send how many messages there are until the one that is None."""
    Path(gate).read_bytes()
    connection.send(len(list(iter(connection.recv, None))))
