"""What commands say beside their results."""

import sys


def tell(line: object) -> None:
    """Say a line on standard error, at once: standard output has the results alone."""
    print(f"underfoot: {line}", file=sys.stderr, flush=True)


def no_window(reason: str) -> str:
    """Return the line that says why there is no window, and what works without it."""
    return (
        f"the window cannot be opened: {reason.rstrip('.')}; docs/install.md says what it needs. The commands of "
        "`underfoot --help` work without it"
    )
