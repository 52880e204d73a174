"""Protocols: presets say what the thesis says, files go round, and what is wrong is one line that names its place."""

import json
import random

import pytest
from made_studies import TD, preset_protocol, protocol_text
from mutations import mutated_document

from underfoot.errors import BadFile
from underfoot.experiments.protocol import Protocol
from underfoot.patch import preset_files
from underfoot.studies.levels import measured_peak_m_s2

PRESETS = preset_files.protocols()


def stage(**changes):
    return {"id": "a", "kind": "read", **changes}


def trials(kind="rating", **parameters):
    return {"id": "main", "kind": "trials", "method": {"kind": kind, "parameters": parameters}}


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_goes_through_a_file_unchanged(name, tmp_path):
    protocol = preset_protocol(name)
    path = tmp_path / "a.json"
    protocol.save(path)
    assert Protocol.load(path) == protocol
    assert path.read_bytes() == PRESETS[name].read_bytes()


@pytest.mark.parametrize("name", ["TC1", "SP05", "WD1"])
def test_the_levels_of_stimuli_are_those_of_table_6_1(name):
    """Peaks of table 6.1, at A = 1 or half of it, under the simulated footstep, by its own rule."""
    table = {"TC1": 3.3, "SP05": 0.5 * 3.7, "WD1": 18.2}
    stimulus = preset_protocol("compliance-rating").stimuli[name]
    patch = stimulus.at(0.0, PRESETS["compliance-rating"].parent)
    assert measured_peak_m_s2(patch) == pytest.approx(table[name], rel=0.1)
    node, parameter = stimulus.scaled_by.split(".")
    softer = stimulus.at(-20.0, PRESETS["compliance-rating"].parent).node(node).parameters[parameter]
    assert softer == pytest.approx(0.1 * patch.node(node).parameters[parameter])


BAD = {
    "not JSON": ("{", "is not JSON"),
    "a patch": (json.dumps({"format": "underfoot-patch"}), "$.format is 'underfoot-patch'"),
    "newer": (protocol_text(version=9), "$.version is 9; allowed: 1"),
    "no stages": (protocol_text(stages=[]), "$.stages is []; allowed: at least one"),
    "unknown method": (
        protocol_text(stages=[trials("guessing")]),
        "kind is 'guessing'; allowed: absolute-identifi",
    ),
    "no method": (protocol_text(stages=[stage(kind="trials")]), "$.stages[0].method is missing"),
    "unknown parameter": (protocol_text(stages=[trials(blok=1)]), "parameters is 'blok'; allowed: the parameters of"),
    "blocks below one": (protocol_text(stages=[trials(blocks=0)]), "blocks is 0; allowed: whole numbers 1 to 1000"),
    "unknown stimulus": (protocol_text(stages=[trials(rated=["Q"])]), "rated is 'Q'; allowed: the stimuli: TD, X"),
    "impossible level": (
        protocol_text(stimuli={"TD": {**TD, "level_m_s2": 25.0}}),
        "stimuli.TD.level_m_s2 is 25.0; allowed: up to limit_m_s2, 20",
    ),
    "a level that a staircase reaches": (
        protocol_text(stages=[trials("staircases", followed=["TD"], highest_db=40.0)]),
        "reaches 43 m/s^2 with TD; allowed: up to limit_m_s2, 20",
    ),
    "a level that QUEST+ reaches": (
        protocol_text(stages=[trials("bayesian", range_db=[-20.0, 40.0])], stimuli={"TD": TD}),
        "reaches 43 m/s^2 with TD; allowed: up to limit_m_s2, 20",
    ),
    "a factor that would be taken for an answer": (
        protocol_text(stimuli={"TD": {**TD, "factors": {"number": 3}}}),
        "$.stimuli.TD.factors is 'number'; allowed: names that are not columns of the table of trials already",
    ),
    "a staircase of nothing": (
        protocol_text(stages=[trials("staircases", followed=["TD", "X"])]),
        "$.stages[0].method.parameters.followed is 'X'; allowed: stimuli with a level above 0, and with scaled_by",
    ),
    "a level that QUEST+ cannot move": (
        protocol_text(stages=[trials("bayesian")], stimuli={"TD": {"patch": "stimulus-td", "level_m_s2": 0.4}}),
        "$.stages[0].method.parameters.followed is 'TD'; allowed: stimuli with a level above 0, and with scaled_by",
    ),
    "a level that nobody can set": (
        protocol_text(stages=[stage(kind="level", stimulus="X")]),
        "$.stages[0].stimulus is 'X'; allowed: stimuli with a level above 0, and with scaled_by",
    ),
    "negative level": (protocol_text(stimuli={"TD": {**TD, "level_m_s2": -1}}), "level_m_s2 is -1; allowed: a"),
    "NaN": (protocol_text(limit_m_s2=float("nan")), "$.limit_m_s2 is NaN; allowed: a number"),
    "missing patch": (
        protocol_text(stimuli={"TD": {"patch": "nope.json"}}),
        "stimuli.TD.patch: there is no patch",
    ),
    "setting of no node": (
        protocol_text(stimuli={"TD": {**TD, "settings": {"q.gain": 1.0}}}),
        "stimuli.TD.settings is 'q.gain'; allowed: parameters of the patch: tile.tiles",
    ),
    "setting out of range": (
        protocol_text(stimuli={"TD": {**TD, "settings": {"gain.gain": -1e9}}}),
        "stimuli.TD.settings: gain.gain is -10000",
    ),
    "cycle": (
        protocol_text(stages=[stage(), stage(id="b", next="a")]),
        "stages make a cycle: a -> b -> a; let one of them be followed by 'end'",
    ),
    "to nowhere": (
        protocol_text(stages=[stage(next="z")]),
        "$.stages[0].next is 'z'; allowed: stages of this",
    ),
    "left out": (protocol_text(stages=[stage(next="end"), stage(id="b")]), "no stage leads to 'b'"),
    "twice": (
        protocol_text(stages=[stage(), stage()]),
        "$.stages[1].id is 'a'; allowed: an id that no other",
    ),
    "unknown field": (protocol_text(stages=[stage(pause=3)]), "unknown field `pause`"),
    "two options": (
        protocol_text(participant=[{"name": "foot", "text": "Which?", "kind": "choice", "options": ["left"]}]),
        "$.participant[0].options is ['left']; allowed: two or more different ones",
    ),
    "deep": ('{"format": "underfoot-protocol", "title": ' + "[" * 100_000, "is nested deeper than"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_mistake_is_one_line_that_names_its_place(name):
    text, said = BAD[name]
    with pytest.raises(BadFile) as raised:
        Protocol.loads(text, "a.json")
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


ODD = (None, True, -1, 0, 1e308, float("nan"), "", "x", "end", [], {}, [[]], {"a": 1}, "\0", 2**70, "stimulus-td")
KEYS = ("id", "kind", "next", "odd")


@pytest.mark.parametrize("name", PRESETS)
def test_a_mutated_file_is_read_or_refused_in_one_line(name):
    chance = random.Random(name)
    document = json.loads(PRESETS[name].read_text())
    refused = 0
    for _ in range(60):
        said = refusal(mutated_document(document, chance, KEYS, ODD), PRESETS[name].parent)
        refused += bool(said)
        assert "\n" not in said
    assert refused > 10


def refusal(document, folder):
    """What is said of a file that is refused; "" for one that is read."""
    try:
        Protocol.loads(json.dumps(document), "a.json", folder)
    except BadFile as error:
        return str(error)
    return ""
