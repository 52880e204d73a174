"""The other end of the network: a socket that sends and receives OSC, encoded and decoded by python-osc."""

import socket

from pythonosc.osc_message_builder import build_msg
from pythonosc.osc_packet import OscPacket

LOOPBACK = "127.0.0.1"


class OscEnd:
    """A UDP socket on loopback, at any free port where none is given."""

    def __init__(self, port=0):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind((LOOPBACK, port))
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]
        self.messages = []

    @property
    def text(self):
        """Its address, as in plans."""
        return f"{LOOPBACK}:{self.port}"

    def close(self):
        self.socket.close()

    def send_message(self, port, address, *arguments):
        self.send(port, build_msg(address, list(arguments)).dgram)

    def send(self, port, datagram):
        self.socket.sendto(datagram, (LOOPBACK, port))

    def datagrams(self):
        """Return the datagrams received, each as a list of (address, arguments)."""
        found = []
        while True:
            try:
                datagram = self.socket.recv(65536)
            except BlockingIOError:
                return found
            found.append([(timed.message.address, timed.message.params) for timed in OscPacket(datagram).messages])

    def received(self, address):
        """Return the arguments of all messages to an address so far."""
        self.messages += [message for datagram in self.datagrams() for message in datagram]
        return [arguments for to, arguments in self.messages if to == address]


class CursorDecoder:
    """A TUIO 1.1 client after its specification: contacts by id, and those added and removed, bundle by bundle."""

    def __init__(self):
        self.cursors, self.added, self.removed, self.sequences, self.sources = {}, [], [], [], set()
        self._alive, self._sets = [], {}

    def decode(self, datagram):
        for address, (kind, *arguments) in datagram:
            assert address == "/tuio/2Dcur"
            if kind == "source":
                self.sources.add(arguments[0])
            elif kind == "alive":
                self._alive, self._sets = arguments, {}
            elif kind == "set":
                self._sets[arguments[0]] = tuple(arguments[1:])
            else:
                assert kind == "fseq"
                self._frame(arguments[0])

    def _frame(self, sequence):
        assert set(self._alive) >= set(self._sets)
        self.sequences.append(sequence)
        self.added += [id for id in self._alive if id not in self.cursors]
        self.removed += [id for id in self.cursors if id not in self._alive]
        self.cursors = {id: self._sets.get(id, self.cursors.get(id)) for id in self._alive}
