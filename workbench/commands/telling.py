"""What commands say beside their results."""

import sys
from collections.abc import Callable

from underfoot.clock import once_in


def tell(line: object) -> None:
    """Say a line on standard error, at once: standard output has the results alone."""
    print(f"underfoot: {line}", file=sys.stderr, flush=True)


def tell_share() -> Callable[[str, float], bool]:
    """Return what tells once a second how much of something is done, 0 to 1; it always says to go on."""
    is_due = once_in(1.0)

    def told(what: str, share: float) -> bool:
        if is_due():
            tell(f"{what}: {100.0 * min(share, 1.0):.0f} %")
        return True

    return told


def no_window(reason: str) -> str:
    """Return the line that says why there is no window, and what works without it."""
    return (
        f"the window cannot be opened: {reason.rstrip('.')}; docs/install.md says what it needs. The commands of "
        "`underfoot --help` work without it"
    )
