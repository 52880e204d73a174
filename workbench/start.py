"""The installed command: imports the command line so that Ctrl-C ends it meanwhile, too, without a traceback."""

import signal


def main() -> None:
    """Run the command line. While it is imported, Ctrl-C ends this process as the system ends any."""
    is_heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # a shell's background ignores it
    if is_heard:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from underfoot.__main__ import main

    if is_heard:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    main()
