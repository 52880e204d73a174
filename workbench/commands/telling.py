"""What commands say beside their results."""

import sys


def tell(line: object) -> None:
    """Say a line on standard error, at once: standard output has the results alone."""
    print(f"underfoot: {line}", file=sys.stderr, flush=True)
