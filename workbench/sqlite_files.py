"""Addresses of SQLite files."""

import os
from pathlib import PurePath
from urllib.parse import quote


def uri_of(path: PurePath) -> str:
    """Return the address of an absolute path, to which options are added.

    A share of Windows, as which a drive of the network resolves, is no authority of it: SQLite refuses those.

    >>> from pathlib import PurePosixPath, PureWindowsPath
    >>> uri_of(PurePosixPath("/tmp/a?b.uf")), uri_of(PureWindowsPath("C:/a b.uf"))
    ('file:///tmp/a%3Fb.uf', 'file:///C:/a%20b.uf')
    >>> uri_of(PureWindowsPath("//server/share/a.uf"))
    'file:////server/share/a.uf'
    """
    text = path.as_posix()
    return f"file://{'' if text.startswith('/') else '/'}{quote(os.fsencode(text), '/:')}"
