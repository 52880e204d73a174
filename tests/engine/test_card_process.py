"""Sound cards in a process of their own: what a sound server that stands still holds up, and for how long."""

import os
import signal
import subprocess
import sys

import pytest

from underfoot.devices.sound import require_card
from underfoot.engine import card_process
from underfoot.engine.card_process import CardProcess
from underfoot.errors import DeviceError


def test_a_card_whose_server_stands_still_is_given_up_and_asked_again_once_it_goes_on(null_sink, monkeypatch):
    """Calibrate, the end of the window and the start of a study waited for it for ever."""
    server = min(null_sink.threads())
    os.kill(server, signal.SIGSTOP)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(card_process, "ANSWER_S", 0.1)
            with pytest.raises(DeviceError, match="the sound card and its server do not answer"):
                CardProcess(require_card, "")
    finally:
        os.kill(server, signal.SIGCONT)
    CardProcess(require_card, "").close()


def test_a_card_whose_server_stands_still_while_it_plays_is_said(null_sink):
    """In a process of its own, which ends without closing the card: to close it would wait, too.

    On a busy machine PortAudio may find that samples were lost, and end before; that is said, too.
    """
    script = f"""
import os, signal, threading
import numpy as np
from underfoot.devices import sound
from underfoot.errors import DeviceError
sound.STILL_S = 0.5
record = sound.PlayRecord("", "", np.zeros((480_000, 2), np.float32), 2, 48_000)
def stop():
    while not record.played_frames:
        pass
    os.kill({min(null_sink.threads())}, signal.SIGSTOP)
threading.Thread(target=stop).start()
try:
    record.run()
    print("lost", record.lost, flush=True)
except DeviceError as error:
    print(error, flush=True)
os._exit(0)
"""
    try:
        run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    finally:
        os.kill(min(null_sink.threads()), signal.SIGCONT)
    assert run.stdout in ("the sound card stands still; does its server answer? Take it again\n", "lost True\n")
