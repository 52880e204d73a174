"""Ports that nobody else takes before they are opened."""

import random
import socket

_PORTS = range(20_000, 32_000)  # below those that a system gives to sockets without a number


def free_port():
    """Return a port of this machine that is free for UDP and TCP."""
    while True:
        port = random.SystemRandom().choice(_PORTS)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams, socket.socket() as stream:
            try:
                datagrams.bind(("127.0.0.1", port))
                stream.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
