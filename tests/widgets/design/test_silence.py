"""Why nothing is to be heard: in the preview of a silent node, and once over the canvas while a patch plays."""

import numpy as np
import pytest
from made_patches import patch_of

from underfoot.engine.reports import Costs, Preview
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.design.silence import ASLEEP_REPORTS, why_silent
from underfoot.widgets.design.workspace import DesignWorkspace

STEPPED = patch_of(
    ("tile-force.force", "footfall.force"),
    ("footfall.onset", "modal-bank.strike"),
    ("modal-bank.out", "tile-output.acceleration"),
)
ONCE = patch_of(
    ("rhythm.out", "modal-bank.strike"),
    ("modal-bank.out", "tile-output.acceleration"),
    rhythm={"begin": "at once"},
)
AT_EVENTS = ONCE.set("rhythm", "begin", "at events", REGISTRY)
SOUND = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "hiss.wav"})
UNSTARTED = SOUND.set("wav-player", "mode", "at events", REGISTRY)
SHAPED = patch_of(
    ("tile-force.force", "strain-rate-envelope.force"),
    ("strain-rate-envelope.out", "noise.amplitude"),
    ("noise.out", "tile-output.acceleration"),
)
SWELLING = patch_of(("lfo.out", "noise.amplitude"), ("noise.out", "tile-output.acceleration"))
PRODUCT = patch_of(("noise.out", "multiply.a"), ("multiply.out", "tile-output.acceleration"))
UNFED = patch_of(("modal-bank.out", "tile-output.acceleration"))


@pytest.mark.parametrize(
    ("patch", "id", "why"),
    [
        (STEPPED, "tile-output", ""),
        (ONCE, "tile-output", ""),
        (AT_EVENTS, "tile-output", "no wire leads to start of Rhythm, and begin is at events"),
        (SOUND, "tile-output", ""),
        (UNSTARTED, "tile-output", "no wire leads to start of WAV player, and mode is at events"),
        (UNSTARTED, "wav-player", "no wire leads to start, and mode is at events"),
        (SOUND.set("wav-player", "file", "", REGISTRY), "tile-output", "WAV player has no file"),
        (UNFED, "modal-bank", "no wire leads to strike"),
        (UNFED, "tile-output", "no wire leads to strike of Modal bank"),
        (STEPPED.mark(["footfall"], "muted", on=True), "tile-output", "Footfall is muted"),
        (Patch().add("tile-force", REGISTRY), "tile-force", ""),
        (SHAPED, "tile-output", ""),
        (SHAPED.mark(["strain-rate-envelope"], "muted", on=True), "noise", "Strain rate envelope is muted"),
        (SWELLING, "tile-output", ""),
        (PRODUCT, "tile-output", "no wire leads to b of Multiply"),
        (SHAPED.remove(["tile-force"]), "tile-output", "no wire leads to force of Strain rate envelope"),
        (STEPPED.set("modal-bank", "level", 0.0, REGISTRY), "tile-output", "level of Modal bank is −∞ dB"),
        (SHAPED.set("noise", "amplitude", 0.0, REGISTRY), "tile-output", ""),
        (SHAPED.set("tile-output", "tiles", "t2+t3", REGISTRY), "tile-output", "Tile output is not for t1"),
        (PRODUCT.mark(["multiply"], "bypassed", on=True), "tile-output", ""),
        (SHAPED.add("strike", REGISTRY).mark(["strike"], "soloed", on=True), "tile-output", "Strike is soloed"),
        (SHAPED.mark(["noise"], "soloed", on=True), "tile-output", ""),
    ],
)
def test_the_nearest_that_silences_a_node_is_named(patch, id, why):
    assert why_silent(patch, REGISTRY, id, "t1") == why


@pytest.fixture
def design(qtbot):
    workspace = DesignWorkspace(REGISTRY)
    qtbot.addWidget(workspace)
    workspace.resize(1000, 700)
    workspace.show()
    workspace.silence_hint.begin(True)
    return workspace


def sleep(design, reports, awake=0):
    costs = Costs({}, {node.id: awake for node in design.patch().nodes})
    for _ in range(reports):
        design.show_costs(costs)


def test_what_a_patch_waits_for_is_said_once_over_the_canvas(design):
    design.set_patch(STEPPED)
    sleep(design, ASLEEP_REPORTS - 1)
    assert design.canvas.message == ""
    sleep(design, 1)
    assert "no foot presses a tile" in design.canvas.message
    design.canvas.show_message("")
    sleep(design, 2 * ASLEEP_REPORTS)
    assert design.canvas.message == ""


def test_why_a_patch_is_silent_does_not_stay_over_another_one(design):
    design.set_patch(STEPPED)
    sleep(design, ASLEEP_REPORTS)
    assert design.canvas.message
    design.set_patch(ONCE)
    assert design.canvas.message == ""


def test_what_has_sounded_says_nothing(design):
    design.set_patch(STEPPED)
    sleep(design, 1, awake=1)
    sleep(design, 2 * ASLEEP_REPORTS)
    design.silence_hint.begin(False)
    sleep(design, 2 * ASLEEP_REPORTS)
    assert design.canvas.message == ""


@pytest.mark.parametrize(
    ("patch", "words"),
    [
        (UNFED, "no wire leads to strike of Modal bank"),
        (ONCE, "P plays it from the start"),
        (Patch().add("noise", REGISTRY), "through a Tile output"),
    ],
)
def test_a_patch_that_cannot_sound_says_why(design, patch, words):
    design.set_patch(patch)
    sleep(design, ASLEEP_REPORTS)
    assert words in design.canvas.message


def test_a_patch_that_is_not_played_is_not_said_to_have_come_to_its_end(design):
    """Its sound file is gone, as the status line says."""
    design.set_patch(SOUND)
    for _ in range(ASLEEP_REPORTS):
        design.show_costs(Costs({}, {}))
    assert design.canvas.message == ""


def test_a_silent_preview_says_why(design):
    design.set_patch(UNFED)
    design.preview.expect("modal-bank", REGISTRY["modal-bank"], why_silent=why_silent(UNFED, REGISTRY, "modal-bank"))
    silence = np.zeros(480, np.float32)
    made = Preview(1, 48_000.0, silence, {"modal-bank.out": silence})
    design.preview.show_preview(made)
    assert design.preview.plots.waveform.drawing.note == "no wire leads to strike"
