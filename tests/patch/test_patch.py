"""The document: edits, checks, and files that are not what they should be."""

import json
import string

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.groups import FURTHEST
from underfoot.patch.patch import FORMAT, VERSION, Patch, PlacedNode

ROUGHLY = settings(max_examples=150)


def chain():
    """Force, envelope, gain of noise, output: with wires of a signal, of events, and to a parameter."""
    patch = Patch(title="chain", seed=4)
    for type in ("tile-force", "force-envelope", "noise", "low-pass", "tile-output", "footfall", "modal-bank"):
        patch = patch.add(type, REGISTRY)
    for source, target in (
        ("tile-force.force", "force-envelope.force"),
        ("force-envelope.out", "noise.amplitude"),
        ("noise.out", "low-pass.signal"),
        ("low-pass.out", "tile-output.acceleration"),
        ("tile-force.force", "footfall.force"),
        ("footfall.onset", "modal-bank.strike"),
    ):
        patch = patch.connect(source, target, REGISTRY)
    return patch


def document(**changes):
    return {"format": FORMAT, "version": VERSION, **changes}


def with_node(type="low-pass", **changes):
    return document(nodes=[{"id": "a", "type": type, **changes}])


# --- edits ---


def test_ids_are_the_type_and_the_first_free_number():
    patch = Patch().add("gain", REGISTRY).add("gain", REGISTRY).add("gain", REGISTRY)
    assert [node.id for node in patch.nodes] == ["gain", "gain1", "gain2"]
    again = patch.remove(["gain1"]).add("gain", REGISTRY)
    assert [node.id for node in again.nodes] == ["gain", "gain2", "gain1"]


def test_every_edit_leaves_the_old_patch_as_it_was_and_shares_what_stayed():
    patch = chain()
    before = patch.dumps()
    edits = (
        patch.add("gain", REGISTRY, at=(8.0, 16.0), gain=2.0),
        patch.remove(["noise"]),
        patch.connect("noise.out", "tile-output.acceleration", REGISTRY),
        patch.disconnect([("noise.out", "low-pass.signal")]),
        patch.set("low-pass", "cutoff", 120.0, REGISTRY),
        patch.move({"noise": (40.0, 80.0)}),
        patch.paste(patch.part(["noise", "low-pass"]), REGISTRY),
        patch.part(["noise"]),
    )
    for edited in edits:
        assert edited != patch
        assert patch.dumps() == before
        changed = {node.id for node in edited.nodes if node not in patch.nodes}
        assert all(edited.node(n.id) is n for n in patch.nodes if n.id not in changed and n in edited.nodes)


def test_an_edit_and_its_contrary_give_an_equal_patch():
    patch = chain()
    assert patch.set("low-pass", "q", 2.0, REGISTRY).set("low-pass", "q", 3.0, REGISTRY) == patch.set(
        "low-pass", "q", 3.0, REGISTRY
    )
    assert patch.move({"noise": (40.0, 80.0)}).move({"noise": (0.0, 0.0)}) == patch
    assert patch.add("gain", REGISTRY).remove(["gain"]) == patch
    wire = ("low-pass.out", "tile-output.acceleration")
    assert patch.add("gain", REGISTRY).connect("gain.out", wire[1], REGISTRY).remove(["gain"]).connect(
        *wire, REGISTRY
    ) == msgspec.structs.replace(patch, wires=(*(w for w in patch.wires if w != wire), wire))


def test_removing_a_node_takes_its_wires_and_no_others():
    patch = chain().remove(["low-pass"])
    assert all("low-pass" not in end for wire in patch.wires for end in wire)
    assert len(patch.wires) == len(chain().wires) - 2
    with pytest.raises(BadValue, match=r"^there is no 'nobody'; allowed: .*low-pass, "):  # it did nothing, silently
        chain().remove(["low-pass", "nobody"])


def test_a_second_wire_at_an_input_takes_the_place_of_the_first():
    patch = chain().connect("noise.out", "tile-output.acceleration", REGISTRY)
    assert [source for source, target in patch.wires if target == "tile-output.acceleration"] == ["noise.out"]


def test_copies_get_new_ids_and_the_wires_between_them():
    patch = chain()
    copied = Patch.loads(patch.part(["noise", "low-pass", "modal-bank"]).dumps(), REGISTRY)
    assert copied.wires == (("noise.out", "low-pass.signal"),)
    pasted = patch.paste(copied, REGISTRY, by=(8.0, 8.0)).paste(copied, REGISTRY)
    assert [node.id for node in pasted.nodes[-6:]] == [
        f"{t}{i}" for i in "12" for t in ("noise", "low-pass", "modal-bank")
    ]
    assert pasted.wires[-2:] == (("noise1.out", "low-pass1.signal"), ("noise2.out", "low-pass2.signal"))
    assert pasted.node("noise1").at == (8.0, 8.0)
    assert pasted.node("low-pass2").parameters == patch.node("low-pass").parameters


def test_ids_that_are_only_digits_can_be_pasted_again():
    patch = Patch(nodes=(PlacedNode("7", "gain"),)).check(REGISTRY)
    assert len({node.id for node in patch.paste(patch, REGISTRY).paste(patch, REGISTRY).nodes}) == 3


@pytest.mark.parametrize("place", [(float("nan"), 0.0), (0.0, float("inf")), (2.0 * FURTHEST, 0.0)])
def test_a_node_cannot_be_moved_to_where_no_file_could_put_it(place):
    with pytest.raises(BadValue, match=r"nodes\[2\]\.at"):
        chain().move({"noise": place})
    with pytest.raises(BadValue, match=r"\.at"):
        chain().add("gain", REGISTRY, at=place)


def test_the_order_puts_every_node_behind_its_sources():
    patch = chain()
    order = patch.order()
    assert sorted(order) == sorted(node.id for node in patch.nodes)
    for source, target in patch.wires:
        assert order.index(source.partition(".")[0]) < order.index(target.partition(".")[0])


def test_a_long_chain_needs_no_deep_stack():
    nodes = tuple(PlacedNode(f"n{i}", "gain") for i in range(3000))
    wires = tuple((f"n{i}.out", f"n{i + 1}.signal") for i in range(2999))
    assert Patch(nodes=nodes[::-1], wires=wires).check(REGISTRY).order() == tuple(f"n{i}" for i in range(3000))


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda p: p.add("nope", REGISTRY), "nodes[7].type is 'nope'; allowed: a node of `underfoot nodes`"),
        (lambda p: p.add("gain", REGISTRY, nope=1.0), "nodes[7].parameters is 'nope'; allowed: the parameters of gain"),
        (lambda p: p.set("nobody", "q", 1.0, REGISTRY), "there is no node 'nobody'; allowed: tile-force, "),
        (lambda p: p.set("low-pass", "nope", 1.0, REGISTRY), "allowed: the parameters of low-pass: cutoff, q"),
        (
            lambda p: p.set("low-pass", "cutoff", 0.5, REGISTRY),
            "low-pass.parameters.cutoff is 0.5; allowed: 1 to 20000 Hz",
        ),
        (lambda p: p.set("low-pass", "cutoff", float("nan"), REGISTRY), "cutoff is nan; allowed: 1 to 20000 Hz"),
        (lambda p: p.set("low-pass", "cutoff", True, REGISTRY), "cutoff is True; allowed: 1 to 20000 Hz"),
        (lambda p: p.connect("nobody.out", "low-pass.signal", REGISTRY), "allowed: nodes of this patch (tile-force, "),
        (lambda p: p.connect("noise", "low-pass.signal", REGISTRY), 'allowed: a node and a port, as "node.port"'),
        (lambda p: p.connect("noise.nope", "low-pass.signal", REGISTRY), "allowed: the outputs of noise: out"),
        (lambda p: p.connect("noise.out", "low-pass.nope", REGISTRY), "the inputs of low-pass: signal, cutoff, q"),
        (lambda p: p.connect("noise.out", "low-pass.out", REGISTRY), "the inputs of low-pass: signal, cutoff, q"),
        (lambda p: p.connect("low-pass.signal", "noise.low", REGISTRY), "the outputs of low-pass: out"),
        (lambda p: p.connect("footfall.onset", "low-pass.signal", REGISTRY), "signals only, and footfall.onset gives"),
        (lambda p: p.connect("noise.out", "modal-bank.strike", REGISTRY), "events only, and noise.out gives signals"),
        (lambda p: p.connect("noise.out", "force-envelope.force", REGISTRY), "N, not m/s^2; put a Scale node between"),
        (lambda p: p.connect("tile-force.force", "low-pass.cutoff", REGISTRY), "allowed: Hz, not N"),
        (lambda p: p.connect("low-pass.out", "low-pass.signal", REGISTRY), "cycle: low-pass <- low-pass"),
        (lambda p: p.connect("low-pass.out", "noise.low", REGISTRY), "cycle: "),
    ],
)
def test_an_edit_that_cannot_be_says_why_in_one_line(edit, message):
    patch = chain()
    before = patch.dumps()
    with pytest.raises(BadValue) as error:
        edit(patch)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    assert patch.dumps() == before


def test_a_cycle_is_named_in_full():
    patch = Patch(
        nodes=tuple(PlacedNode(id, "gain") for id in "abcd"),
        wires=(("a.out", "b.signal"), ("b.out", "c.signal"), ("c.out", "b.gain"), ("c.out", "d.signal")),
    )
    with pytest.raises(BadValue, match="take one of these wires away") as error:
        patch.check(REGISTRY)
    loop = str(error.value).partition("cycle: ")[2].partition(";")[0].split(" <- ")
    assert loop in (["b", "c", "b"], ["c", "b", "c"])


# --- files ---


def test_a_file_is_read_as_it_was_written_and_has_format_and_version_first(tmp_path):
    patch = chain().move({"noise": (1.5, -2.25)}).set("modal-bank", "modes", [[100, 2, 3.5]], REGISTRY)
    patch.save(tmp_path / "a.json")
    assert Patch.load(tmp_path / "a.json", REGISTRY) == Patch.loads(patch.dumps(), REGISTRY)
    assert Patch.load(tmp_path / "a.json", REGISTRY).dumps() == patch.dumps()
    assert list(json.loads(patch.dumps()))[:2] == ["format", "version"]
    assert patch.dumps().count(b"\n") > 60, "a line a parameter"


def test_a_patch_that_names_nothing_but_its_format_is_empty():
    assert Patch.loads(json.dumps(document()), REGISTRY) == Patch()


WRONG = [
    ("", "is not JSON"),
    ("{", "is not JSON"),
    ("null", "format is null"),
    ("[]", "format is []"),
    (b"\xff\xfe\x00\x01", "is not JSON"),
    (b'{"title": "\xe9"}', "is not JSON: it is not UTF-8 text"),
    ('{"format": "underfoot-patch", "version": 1, "seed": NaN}', "seed is NaN; allowed: a whole number"),
    ('{"format": "underfoot-patch", "version": 1, "seed": 1e999}', "seed is Infinity; allowed: a whole number"),
    ("[" * 100_000, "is nested deeper than"),
    (
        '{"format": "underfoot-patch", "version": 1, "title": ' + "[" * 3000 + "]" * 3000 + "}",
        "is nested deeper than",
    ),
    ({"version": 1}, "format is null"),
    ({"format": "underfoot-floor", "version": 1}, "format is 'underfoot-floor'; allowed: 'underfoot-patch'"),
    ({"format": FORMAT}, "version is null; allowed: 1"),
    (document(version=0), "version is 0; allowed: 1"),
    (document(version="1"), "version is '1'; allowed: 1"),
    (document(version=True), "version is true; allowed: 1"),
    (document(version=99), "version is 99; allowed: 1 (a newer Underfoot may have written it)"),
    (document(version=99, something="new"), "a newer Underfoot may have written it"),
    (document(colour="red"), "unknown field `colour`"),
    (document(**{"x" * 5000: 1}), "unknown field `xxxx"),
    (document(title=3), "title is 3; allowed: text"),
    (document(seed=1.5), "seed is 1.5; allowed: a whole number"),
    (document(nodes={}), "nodes is {}; allowed: a list"),
    (document(nodes="gain"), "nodes is 'gain'; allowed: a list"),
    (document(nodes=[3]), "nodes[0] is 3; allowed: an object"),
    (document(nodes=[{"id": "a"}]), "nodes[0]: object missing required field `type`"),
    (with_node(id=3), "nodes[0].id is 3; allowed: text"),
    (with_node(id="a.b"), "nodes[0].id is 'a.b'; allowed: letters, digits, - and _"),
    (with_node(id=""), "nodes[0].id is ''"),
    (with_node(id="a\nb"), "nodes[0].id is 'a\\nb'"),
    (with_node("nope"), "nodes[0].type is 'nope'"),
    (with_node(at="here"), "nodes[0].at is 'here'; allowed: a list"),
    (with_node(at=["1", "2"]), "nodes[0].at[0] is '1'; allowed: a number"),
    (with_node(at=[1, 2, 3]), "nodes[0].at is [1, 2, 3]; allowed: a list of length 2"),
    (with_node(at=[0, 1e300]), "nodes[0].at is (0.0, 1e+300)"),
    (with_node(parameters=[]), "nodes[0].parameters is []; allowed: an object"),
    (with_node(parameters={"nope": 1}), "nodes[0].parameters is 'nope'; allowed: the parameters of low-pass"),
    (with_node(parameters={"cutoff": "300"}), "nodes[0].parameters.cutoff is '300'; allowed: 1 to 20000 Hz"),
    (with_node(parameters={"cutoff": None}), "nodes[0].parameters.cutoff is None"),
    (with_node(parameters={"cutoff": 1e300}), "nodes[0].parameters.cutoff is 1e+300"),
    (with_node("rhythm", parameters={"repeats": 2.5}), "nodes[0].parameters.repeats is 2.5; allowed: whole numbers"),
    (with_node("rhythm", parameters={"repeats": 10**400}), "nodes[0].parameters.repeats is 1000000"),
    (with_node("rhythm", parameters={"begin": ["at once"]}), "nodes[0].parameters.begin is ['at once']"),
    (with_node("modal-bank", parameters={"modes": [[1, 2]]}), "nodes[0].parameters.modes is [[1, 2]]"),
    (with_node("modal-bank", parameters={"modes": [[1, 2, "3"]]}), "nodes[0].parameters.modes is [[1, 2, '3']]"),
    (with_node("tone", parameters={"harmonics": [True]}), "nodes[0].parameters.harmonics is [True]"),
    (with_node("tile-output", parameters={"tiles": "t1,t2"}), "nodes[0].parameters.tiles is 't1,t2'"),
    (with_node("wav-player", parameters={"file": "a\0b"}), "nodes[0].parameters.file is 'a\\x00b'"),
    ({**with_node(), "groups": [{"id": "g.h", "members": ["a"]}]}, "groups[0].id is 'g.h'; allowed: letters, digits"),
    (document(notes=[{"id": "n.m", "text": "loud"}]), "notes[0].id is 'n.m'; allowed: letters, digits, - and _"),
    (document(wires=[["a.out", "b.in", "c.in"]]), "allowed: a list of length 2"),
    (document(wires=[[1, 2]]), "wires[0][0] is 1; allowed: text"),
    (document(wires=["ab"]), "wires[0] is 'ab'; allowed: a list"),
    (document(wires=[["a.out", "b.signal"]]), "wires[0] is 'a.out'; allowed: nodes of this patch (none)"),
    ({**with_node(), "wires": [["a.out", "a.signal"]]}, "wires make a cycle: a <- a"),
    (document(nodes=[{"id": "a", "type": "gain"}] * 2), "nodes[1].id is 'a'; allowed: an id that no other node has"),
    (
        {
            **document(nodes=[{"id": i, "type": "gain"} for i in "abc"]),
            "wires": [[f"{i}.out", "c.signal"] for i in "ab"],
        },
        "wires[1] is 'c.signal'; allowed: one wire to an input",
    ),
]


@pytest.mark.parametrize(("given", "message"), WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_a_wrong_file_is_refused_with_its_name_the_place_and_what_is_allowed(given, message):
    text = given if isinstance(given, str | bytes) else json.dumps(given)
    with pytest.raises(BadFile) as error:
        Patch.loads(text, REGISTRY, "folder/a.json")
    assert str(error.value).startswith("folder/a.json")
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1000


@pytest.mark.parametrize("depth", range(50, 1200, 50))
def test_no_depth_of_nesting_crashes_it(depth):
    modes = "[" * depth + "]" * depth
    with pytest.raises(BadFile):
        Patch.loads(json.dumps(with_node("modal-bank", parameters={"modes": 7})).replace("7", modes), REGISTRY)


def test_a_number_too_large_for_a_float_is_out_of_range():
    with pytest.raises(BadFile, match="cutoff is 1000"):
        Patch.loads(json.dumps(with_node(parameters={"cutoff": 10**400})), REGISTRY)


@pytest.mark.parametrize("name", ["missing.json", "."])
def test_what_cannot_be_read_is_said(tmp_path, name):
    with pytest.raises(BadFile, match="cannot be read"):
        Patch.load(tmp_path / name, REGISTRY)


def test_what_cannot_be_written_is_said_and_leaves_the_old_file(tmp_path):
    with pytest.raises(BadFile, match="cannot be written"):
        chain().save(tmp_path / "missing" / "a.json")
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadFile, match="cannot be written"):
        chain().save(tmp_path / "folder")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


# --- anything at all ---

NAMES = st.sampled_from([*REGISTRY, *FORMAT.split("-"), "a", "a.out", "gain.signal", "id", "at", "t1+t2", ""])
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), NAMES, st.text(string.printable, max_size=8), st.just(10**25)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(NAMES, inner, max_size=4),
    max_leaves=8,
)


def loads_or_refuses(text):
    """What was read stands the way through a file; what was refused was refused by us, in one line."""
    refusal = ""
    try:
        patch = Patch.loads(text, REGISTRY)
    except UnderfootError as error:
        refusal = str(error)
    else:
        assert Patch.loads(patch.dumps(), REGISTRY) == patch
        assert set(patch.order()) == {node.id for node in patch.nodes}
    assert "\n" not in refusal


@ROUGHLY
@given(st.binary(max_size=200) | st.text(max_size=200))
def test_no_bytes_crash_it(data):
    loads_or_refuses(data)


@ROUGHLY
@given(
    st.fixed_dictionaries(
        {"format": st.just(FORMAT), "version": st.just(VERSION) | SCALARS},
        optional=dict.fromkeys(("title", "comment", "seed", "nodes", "wires", "more"), VALUES),
    )
)
def test_no_document_crashes_it(made):
    loads_or_refuses(json.dumps(made))


@ROUGHLY
@given(st.sampled_from(sorted(preset_files.patches())), st.data())
def test_no_damage_to_a_preset_crashes_it(name, data):
    made = json.loads(preset_files.patches()[name].read_bytes())
    inside = made
    while True:
        keys = list(inside) if isinstance(inside, dict) else list(range(len(inside)))
        key = data.draw(st.sampled_from(keys))
        if not isinstance(inside[key], dict | list) or not inside[key] or data.draw(st.booleans()):
            break
        inside = inside[key]
    if data.draw(st.booleans()):
        inside[key] = data.draw(VALUES)
    else:
        del inside[key]
    loads_or_refuses(json.dumps(made))


TYPES = sorted({node.type for node in chain().nodes} | {"gain", "join"})
PARAMETERS = sorted({name for type in TYPES for name in REGISTRY[type].parameters})
PORTS = sorted(
    f"{type}.{port}" for type in TYPES for port in (*REGISTRY[type].input_ports, *REGISTRY[type].output_ports)
)
ENDS = st.sampled_from(PORTS)
SOME = st.lists(st.sampled_from(TYPES), max_size=3)
EDITS = st.one_of(
    st.tuples(st.just("add"), st.sampled_from(TYPES)),
    st.tuples(st.just("connect"), ENDS, ENDS),
    st.tuples(st.just("set"), st.sampled_from(TYPES), st.sampled_from(PARAMETERS), VALUES),
    st.tuples(
        st.just("move"), st.dictionaries(st.sampled_from(TYPES), st.tuples(st.floats(), st.floats()), max_size=2)
    ),
    st.tuples(st.just("remove"), SOME),
    st.tuples(st.just("paste"), SOME),
)


@ROUGHLY
@given(st.lists(EDITS, max_size=12))
def test_no_edits_lead_to_a_patch_that_a_file_cannot_hold(edits):
    patch = chain()
    for edit, *what in edits:
        try:
            if edit == "paste":
                patch = patch.paste(patch.part(what[0]), REGISTRY)
            else:
                needs_registry = edit in ("add", "connect", "set")
                patch = getattr(patch, edit)(*what, *([REGISTRY] if needs_registry else []))
        except BadValue:
            continue
        assert Patch.loads(patch.dumps(), REGISTRY).dumps() == patch.dumps()
