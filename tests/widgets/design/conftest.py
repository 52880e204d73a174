"""Patches of nodes in a row, for tests of groups and sub-patches, and a workspace of all nodes."""

import pytest
from design_samples import REGISTRY, shared_workspace
from groups_by_hand import write
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from underfoot.nodes import REGISTRY as ALL_NODES
from underfoot.patch.patch import Patch

CONTROL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture(scope="module")
def all_nodes(qapp):
    """A Design workspace of all nodes, shared by these tests."""
    yield from shared_workspace(ALL_NODES)


@pytest.fixture
def row(workspace):
    """A tone through two nodes to the shaker, with room between."""
    patch = Patch().add("hum", REGISTRY).add("through", REGISTRY, (200.0, 0.0)).add("through", REGISTRY, (400.0, 0.0))
    patch = patch.add("shaker", REGISTRY, (600.0, 0.0))
    for wire in (("hum.out", "through.signal"), ("through.out", "through1.signal")):
        patch = patch.connect(*wire, REGISTRY)
    workspace.set_patch(patch.connect("through1.out", "shaker.acceleration", REGISTRY))
    workspace.canvas.zoom_to(1.0)
    return workspace


@pytest.fixture
def chain(row):
    """The row, whose two nodes in the middle are a group named "Chain"."""
    row.canvas.patch_scene.select(["through", "through1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    write(row, "Chain")
    return row
