"""Patches with a custom node in a file beside them."""

import pytest

HUM = """
from pathlib import Path

from underfoot.parameters import Number
from underfoot.patch.node import Output, node

with Path(__file__).with_suffix(".ran").open("a") as file:
    file.write("x")


@node("hum-of-mine", "Mine")
class Hum:
    "A square wave of 100 Hz at 48 kHz."

    strength = Number(1.0, 0.0, 100.0, unit="m/s^2", doc="how much")
    out = Output("m/s^2")

    def run(strength, frame, out):
        for i in range(out.size):
            out[i] = SIGN * strength * ((frame + i) // 240 % 2 * 2 - 1)
"""


class OwnNodeFolder:
    """A folder with a patch `hum.json` whose node is in `nodes/hum-of-mine.py`; that file records each run."""

    def __init__(self, folder):
        from underfoot.patch.patch import Patch, PlacedNode

        self.folder, self.patch, self.file = folder, folder / "hum.json", folder / "nodes" / "hum-of-mine.py"
        self.file.parent.mkdir()
        hum = PlacedNode("hum", "hum-of-mine", (0.0, 0.0), {"strength": 2.5})
        out = PlacedNode("out", "tile-output", (240.0, 0.0), {})
        document = Patch(title="Hum", nodes=(hum, out), wires=(("hum.out", "out.acceleration"),))
        self.patch.write_bytes(document.dumps())
        self.write()

    def write(self, sign="1.0"):
        """Write the node's file; another `sign` makes it a different file, silent at 0."""
        self.file.write_text(HUM.replace("SIGN", sign))

    @property
    def runs(self):
        """Return how often the file was run, in any process."""
        runs = self.file.with_suffix(".ran")
        return len(runs.read_text()) if runs.exists() else 0


@pytest.fixture
def own_node(tmp_path):
    """Yield such a folder; unregister its nodes afterwards."""
    from underfoot.nodes import REGISTRY
    from underfoot.patch.node_files import RUNNING

    yield OwnNodeFolder(tmp_path)
    RUNNING.clear()
    REGISTRY.pop("hum-of-mine", None)
