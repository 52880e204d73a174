"""Names, notes and groups in a patch: what a file holds of them, and that they change nothing that is computed."""

import json
import random

import msgspec
import numpy as np
import pytest
from loops import loop_of, played
from mutations import mutated_document

from underfoot.engine.patch_edits import moved_numbers
from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.grouping import grouped, published, put_into, ungrouped
from underfoot.patch.groups import Group, Note, chain, innermost
from underfoot.patch.patch import Patch

PRESETS = preset_files.patches()


def gravel():
    return Patch.load(PRESETS["gravel"], REGISTRY)


def dressed(patch=None):
    """A patch with a name, a note, a group, and a collapsed group in that."""
    patch = patch or gravel()
    ids = [node.id for node in patch.nodes]
    patch = patch.name(ids[1], "Pressing")
    id = patch.free_id("note")
    note = Note(id, "Stones slip.\nThen they ring.", (40.0, -80.0))
    patch = grouped(msgspec.structs.replace(patch, notes=(note,)), [*ids[1:6], id], "Stones", "amber")
    patch = grouped(patch, ids[2:4], "Slips")
    inner = msgspec.structs.replace(patch.groups[1], collapsed=True, at=(8.0, 16.0))
    return msgspec.structs.replace(patch, groups=(patch.groups[0], inner)).check(REGISTRY)


# --- files ---


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_stands_the_round_trip_byte_for_byte(name):
    patch = Patch.load(PRESETS[name], REGISTRY)
    assert Patch.loads(patch.dumps(), REGISTRY).dumps() == patch.dumps() == PRESETS[name].read_bytes()
    again = dressed(patch) if len(patch.nodes) > 6 else patch
    assert Patch.loads(again.dumps(), REGISTRY) == again


def test_a_file_without_them_is_one_that_older_programs_read():
    fields = json.loads(gravel().dumps())
    assert list(fields) == ["format", "version", "title", "comment", "seed", "nodes", "wires"]
    assert {key for node in fields["nodes"] for key in node} == {"id", "type", "at", "parameters"}
    assert json.loads(dressed().dumps())["version"] == fields["version"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"notes": [{"id": "out"}]}, "notes[0].id is 'out'; allowed: an id that no other node, note or group has"),
        ({"notes": [{"id": "n", "text": "x" * 5000}]}, "allowed: text of at most 4000 characters"),
        ({"notes": [{"id": "n", "width": 1}]}, "notes[0].width is 1.0; allowed: 64 to 2000"),
        ({"notes": [{"id": "n", "at": [0, 1e300]}]}, "notes[0].at is (0.0, 1e+300)"),
        ({"groups": [{"id": "g"}]}, "groups[0].members is '[]'; allowed: one node or note, or more"),
        ({"groups": [{"id": "g", "members": ["x"]}]}, "groups[0].members is 'x'; allowed: nodes and notes of this"),
        ({"groups": [{"id": "g", "members": ["out", "out"]}]}, "allowed: each member once"),
        ({"groups": [{"id": "g", "members": ["out"], "colour": "pink"}]}, "allowed: grey, teal, amber"),
        ({"groups": [{"id": "g", "members": ["out"], "title": "a\nb"}]}, "one line of at most 80 characters"),
        ({"groups": [{"id": "g", "members": ["out"], "published": ["out.x"]}]}, "groups[0].published is 'out.x'"),
        (
            {"groups": [{"id": "g", "members": ["out", "sound"]}, {"id": "h", "members": ["sound", "tile"]}]},
            "groups[1] would hold a part of the group 'g'; take all of it, or nothing",
        ),
        (
            {"groups": [{"id": "h", "members": ["out"]}, {"id": "g", "members": ["out", "sound"]}]},
            "groups[1] would hold a part of the group 'h'",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(changes, message):
    with pytest.raises(BadFile) as error:
        Patch.loads(json.dumps({**json.loads(gravel().dumps()), **changes}), REGISTRY, "a.json")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


# --- edits ---


def test_groups_lie_within_one_another_or_apart():
    patch = dressed()
    assert chain(patch.groups, "group1") == ["group", "group1"]
    assert innermost(patch.groups)[patch.nodes[2].id] == "group1"
    around = grouped(patch, [node.id for node in patch.nodes[:8]] + ["note"])
    assert [group.id for group in around.groups] == ["group2", "group", "group1"]
    with pytest.raises(BadValue, match="a part of the group"):
        grouped(patch, [patch.nodes[0].id, patch.nodes[2].id])
    assert ungrouped(around, ["group2"]).groups == patch.groups


def test_a_new_node_goes_into_a_group_and_into_those_around_it():
    patch = put_into(dressed().add("gain", REGISTRY), ["gain"], "group1")
    assert all("gain" in group.members for group in patch.groups)
    assert patch.remove(["gain"]) == dressed()


def test_a_collapsed_group_is_moved_with_all_that_is_in_it():
    patch = dressed()
    moved = patch.move({"group1": (108.0, 16.0)})
    for node in patch.nodes:
        by = 100.0 if node.id in patch.group("group1").members else 0.0
        assert moved.node(node.id).at == (node.at[0] + by, node.at[1])
    outer = patch.move({"group": (10.0, 0.0)})
    assert outer.group("group1").at == (18.0, 16.0)
    assert outer.notes[0].at == (50.0, -80.0)


def test_a_group_goes_with_its_last_member_and_is_copied_when_all_of_it_is():
    patch = dressed()
    inner = patch.group("group1").members
    assert [group.id for group in patch.remove(inner).groups] == ["group"]
    without = patch.remove(["note"])
    assert without.notes == ()
    assert "note" not in without.group("group").members
    part = patch.part(inner)
    assert [group.id for group in part.groups] == ["group1"]
    assert patch.part(["group1"]) == part
    assert patch.part(inner[:1]).groups == ()
    after = patch.paste(part, REGISTRY, (10.0, 0.0))
    copy = after.groups[-1]
    assert copy.id == "group2"
    assert copy.at == (18.0, 16.0)
    assert not set(copy.members) & {node.id for node in patch.nodes}
    assert after.check(REGISTRY) is after


def test_what_is_shown_of_a_node_goes_with_it_and_is_copied_with_it():
    patch = dressed()
    first, *_ = patch.group("group1").members
    name = next(iter(REGISTRY[patch.node(first).type].parameters))
    patch = published(patch, "group1", f"{first}.{name}", on=True)
    assert patch.remove([first]).check(REGISTRY).group("group1").published == ()
    copy = patch.paste(patch.part(patch.group("group1").members), REGISTRY).check(REGISTRY).groups[-1]
    assert copy.published == (f"{copy.members[0]}.{name}",)


def test_a_group_of_all_that_is_in_the_opened_one_lies_in_it():
    members = dressed().group("group1").members
    for within, ids in (("group1", ["group", "group1", "group2"]), ("", ["group", "group2", "group1"])):
        assert [group.id for group in grouped(dressed(), members, within=within).groups] == ids


# --- what is computed ---


def test_names_notes_and_groups_are_no_edit_to_the_engine():
    assert moved_numbers(gravel(), dressed(), REGISTRY) == []


def test_the_bytes_are_the_same_collapsed_or_not():
    plain, grouped_too = (played(loop_of(patch, block=128), 24_000) for patch in (gravel(), dressed()))
    assert np.any(plain)
    assert plain.tobytes() == grouped_too.tobytes()


# --- damage ---

ODD = (None, True, -1, 1e308, float("nan"), "", "x", "note", "group", "tile", [], {}, [[]], ["tile"], {"id": "x"}, "\0")
KEYS = ("id", "at", "members", "label", "text", "odd")


def read_or_refused(document):
    """ "" for a file that is read and written to the same bytes, else why it is refused."""
    try:
        patch = Patch.loads(json.dumps(document), REGISTRY, "a.json")
    except UnderfootError as error:
        return str(error)
    assert Patch.loads(patch.dumps(), REGISTRY).dumps() == patch.dumps()
    return ""


def test_a_mutated_patch_is_read_or_refused_in_one_line():
    chance, refused = random.Random(4), 0
    document = json.loads(dressed().dumps())
    small = {**document, "nodes": document["nodes"], "wires": document["wires"][:2]}
    for _ in range(400):
        said = read_or_refused(mutated_document(chance.choice((document, small)), chance, KEYS, ODD))
        refused += bool(said)
        assert "\n" not in said
    assert 100 < refused < 400


def test_members_in_any_order_are_a_family_of_sets_or_are_refused():
    chance = random.Random(1)
    ids = [node.id for node in gravel().nodes][:6]
    for _ in range(300):
        groups = tuple(Group(f"g{i}", tuple(chance.sample(ids, chance.randint(1, 4)))) for i in range(3))
        sets = [set(group.members) for group in groups]
        nested = all(b <= a or not a & b for i, a in enumerate(sets) for b in sets[i + 1 :])
        try:
            msgspec.structs.replace(gravel(), groups=groups).check(REGISTRY)
        except BadValue:
            assert not nested
        else:
            assert nested
