"""What a command prints into pipes that end, full disks and closed outputs: one line at most, and a status."""

import os
import subprocess
import sys
from contextlib import redirect_stdout
from io import TextIOWrapper

import pytest

COMMANDS = [["nodes"], ["convert", "--formats"], ["-h"], ["monitor", "corridor"]]
"""More than is kept before it is written, less, what click prints, and steps one by one, of which none is kept."""


def started(arguments, stdout):
    command = [sys.executable, "-m", "underfoot", *arguments]
    buffered = os.environ | {"PYTHONUNBUFFERED": ""}
    return subprocess.Popen(command, stdout=stdout, stderr=subprocess.PIPE, text=True, env=buffered)


def lines_of(error):
    return [line for line in error.splitlines() if not line.startswith(("underfoot: first use", "underfoot: person"))]


@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_a_pipe_that_ends_is_no_error_to_be_told(arguments):
    read, write = os.pipe()
    os.close(read)
    process = started(arguments, write)
    os.close(write)
    _, error = process.communicate()
    assert process.returncode == 1
    assert [line for line in lines_of(error) if "kernels compiled" not in line] == []


WINDOWS_PIPE = """
import io, os, stat, sys
class Pipe(io.FileIO):
    def write(self, data):
        if stat.S_ISFIFO(os.fstat(1).st_mode):
            raise OSError(22, "Invalid argument")
        return super().write(data)
sys.stdout = io.TextIOWrapper(io.BufferedWriter(Pipe(1, "w", closefd=False)), "utf-8")
sys.argv = ["underfoot", "convert", "--formats"]
from underfoot.__main__ import main
main()
"""
"""Writing to a pipe whose reader has ended fails with another error there."""


def test_nor_is_a_pipe_that_ends_on_windows():
    done = subprocess.run([sys.executable, "-c", WINDOWS_PIPE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
@pytest.mark.parametrize("arguments", [one for one in COMMANDS if one != ["-h"]], ids=" ".join)
def test_a_full_disk_is_one_line(arguments):
    with open("/dev/full", "w") as full:
        process = started(arguments, full)
    _, error = process.communicate()
    assert process.returncode == 1
    found = [line for line in lines_of(error) if "kernels compiled" not in line]
    assert found == ["underfoot: what is printed cannot be written: no space left on device"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
@pytest.mark.parametrize("arguments", COMMANDS[:-1], ids=" ".join)
def test_no_command_keeps_to_itself_that_its_first_line_is_refused(underfoot, arguments):
    disk = open("/dev/full", "wb", buffering=0)  # noqa: SIM115 - closed with the text
    with TextIOWrapper(disk, write_through=True) as full, redirect_stdout(full):
        done = underfoot(*arguments)
    refused = "underfoot: what is printed cannot be written: no space left on device\n"
    assert (done.status, done.error) == (1, refused)


def test_a_sign_that_an_output_has_not_is_replaced():
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    command = [sys.executable, "-m", "underfoot", "levels", "stimulus-sp"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    assert "commanded, m/s?" in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="there is no sh")
def test_a_closed_output_is_no_error():
    shell = f"exec '{sys.executable}' -m underfoot nodes >&-"
    done = subprocess.run(["sh", "-c", shell], stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
