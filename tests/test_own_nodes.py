"""Nodes in files beside a patch: nothing in them is run without consent; with it they play, in every process."""

import re
from pathlib import Path

import numpy as np
import pytest
import soundfile

import underfoot as uf
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.custom_nodes import node_files, run_file
from underfoot.patch.patch import Patch, PlacedNode


@pytest.mark.parametrize(
    "command",
    [("render", "hum.json", "-o", "a.wav"), ("levels", "hum.json"), ("cost", "hum.json"), ("distribution", "hum.json"),
     ("convert", "hum.json", "-o", "a.zip"), ("serve", "simulator", "--patch", "hum.json"),
     ("monitor", "simulator", "--patch", "hum.json", "--seconds", "1")],
)  # fmt: skip
def test_no_command_runs_a_file_that_nobody_agreed_to(refused, own_node, command):
    assert f"{own_node.file}, which runs with your rights" in refused(*command)
    assert own_node.runs == 0


def test_run_code_plays_the_node_for_this_command_alone(underfoot, folder, own_node):
    said = underfoot("render", "hum.json", "-o", "a.wav", "--seconds", "0.3", "--force", "none", "--run-code")
    assert (said.status, said.error) == (0, "")
    assert np.abs(soundfile.read("a.wav")[0]).max() > 0.0
    runs = own_node.runs  # here, and where the kernels had to be compiled in another process
    assert runs >= 1
    own_node.write(sign="-1.0")  # another file than the one that was agreed to
    assert "--run-code" in underfoot("render", "hum.json", "-o", "b.wav").error
    assert own_node.runs == runs


@pytest.mark.parametrize(
    ("text", "says"),
    [("1 / 0", "cannot be run: ZeroDivisionError: division by zero"), ("def (", "cannot be run: SyntaxError"),
     ("raise SystemExit(3)", "cannot be run: SystemExit: 3"), ("", "has no node 'hum-of-mine' but none"),
     ("\n" * 1_000_001, "allowed: 1000000")],
)  # fmt: skip
def test_a_broken_file_is_one_line(refused, own_node, text, says):
    own_node.file.write_text(text)
    assert says in refused("render", "hum.json", "-o", "a.wav", "--run-code")


def test_a_file_takes_the_place_of_no_node_and_lies_in_its_own_folder_alone(tmp_path):
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "gain.py").write_text("1 / 0")
    (tmp_path / "evil.py").write_text("1 / 0")
    assert node_files(tmp_path) == []
    (tmp_path / "p.json").write_bytes(Patch(nodes=(PlacedNode("a", "../evil"),)).dumps())
    with pytest.raises(BadFile, match=r"'\.\./evil'; allowed: a node"):
        Patch.load(tmp_path / "p.json", REGISTRY)


def test_a_node_with_another_file_is_not_mixed_with_the_first(underfoot, folder, own_node):
    other = folder / "other"
    (other / "nodes").mkdir(parents=True)
    (other / "hum2.json").write_bytes(own_node.patch.read_bytes())
    (other / "nodes" / own_node.file.name).write_text(own_node.file.read_text() + "# changed\n")
    said = underfoot("render", "hum.json", "other/hum2.json", "-o", "made", "--seconds", "0.1", "--run-code")
    assert said.status == 1
    assert "are two different nodes of one name" in said.error
    assert [path.name for path in sorted((folder / "made").glob("*.wav"))] == ["hum.wav"]


def test_a_live_session_plays_it_and_its_next_version(own_node, until):
    run_file(node_files(own_node.folder)[0])
    session = Session(Target(default_floor(1, 1)), Patch.load(own_node.patch, REGISTRY), REGISTRY, own_node.folder)

    def loudest():
        session.poll()
        rows = session.vibration.read()[1]
        return np.abs(rows).max() if len(rows) else -1.0

    try:
        session.start()
        until(lambda: loudest() > 0.0, "it plays")
        own_node.write(sign="0.0")
        assert run_file(node_files(own_node.folder)[0])
        session.edit(session.patch, anew=True)
        until(lambda: 0.0 <= loudest() < 1e-6, "the next version plays, which is silent")
    finally:
        session.close()


def test_a_script_agrees_as_the_page_says(folder, own_node):
    page = (Path(__file__).parents[1] / "docs" / "plugins.md").read_text()
    _, code = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    with pytest.raises(BadFile, match="which runs with your rights") as refusal:
        uf.open_patch("hum.json")
    assert "`with allow_all_node_files():` from underfoot.patch.custom_nodes" in str(refusal.value)
    found = {}
    exec(code, found)
    nobody = uf.Forces(np.arange(100) / 1000.0, np.zeros((100, 1, 4)), 1000.0, uf.default_floor(1, 1))
    assert np.abs(uf.render(found["patch"], nobody, seconds=0.1).samples).max() > 0.0


HELPER = """
from underfoot.kernels import kernel

@kernel
def louder(x):
    return x + wave
"""


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("out[i] = wave", r", line 20: run of Hum cannot be compiled: NameError: name 'wave' is not defined$"),
        ("out[i] = louder(strength)", r", line 26: run of Hum cannot be compiled: NameError: name 'wave' is not def"),
        ("out[i] = 'loud'", r", line 20: run of Hum cannot be compiled: there is no setitem\(.*str.*\)$"),
        ("out[i] = strength.loud", r", line 20: run of Hum cannot be compiled: Unknown attribute 'loud' of"),
        ("import numpy", r": run of Hum cannot be compiled: Use of unsupported opcode \(IMPORT_NAME\)"),
    ],
)
def test_a_function_that_cannot_be_compiled_is_one_line(underfoot, folder, own_node, line, says):
    text = own_node.file.read_text() + HELPER
    own_node.file.write_text(re.sub(r"^( +)out\[i\] = .*$", rf"\1{line}", text, flags=re.MULTILINE))
    assert own_node.file.read_text() != text
    said = underfoot("render", "hum.json", "-o", "a.wav", "--run-code")
    assert said.status == 1
    assert said.error.count("\n") == 1
    assert said.error.startswith(f"underfoot: {own_node.file}")
    assert re.search(says, said.error.strip()), said.error


@pytest.mark.parametrize(
    ("made", "says"),
    [
        ("[1.0 / 0.0]", "table of Hum cannot be made: ZeroDivisionError: float division by zero"),
        ("['loud']", "table of Hum cannot be made: ValueError: could not convert string to float: 'loud'"),
        ("[[1.0, 2.0]]", "table of Hum has 2 dimensions; allowed: 1"),
    ],
)
def test_a_table_that_cannot_be_made_is_one_line(underfoot, folder, own_node, made, says):
    """One of another shape would be read from the wrong places of the memory."""
    text = own_node.file.read_text().replace("import Output, node", "import Output, node, prepared")
    table = f"    @prepared\n    def table(values, rate):\n        return {made}\n\n    def run(table, "
    own_node.file.write_text(text.replace("    def run(", table))
    said = underfoot("render", "hum.json", "-o", "a.wav", "--run-code")
    assert (said.status, said.error) == (1, f"underfoot: {own_node.file}: {says}\n")


@pytest.mark.parametrize(
    ("sizes", "says"),
    [
        ("", "AttributeError: type object 'Hum' has no attribute 'sizes'"),
        ("return {'m': 3}", "KeyError: 'n'"),
        ("return {'n': -3}", "ValueError: n is -3; allowed: 0 or more"),
        ("return {'n': values['strength']}", "TypeError: 'float' object cannot be interpreted as an integer"),
    ],
)
def test_a_layout_whose_sizes_are_not_given_is_one_line(underfoot, folder, own_node, sizes, says):
    text = own_node.file.read_text().replace(
        "from underfoot.patch", "from underfoot.layouts import Layout\nfrom underfoot.patch"
    )
    body = "    state = Layout('hum', line=('n',))\n\n"
    body += f"    def sizes(values, rate):\n        {sizes}\n\n" if sizes else ""
    own_node.file.write_text(text.replace("    def run(", f"{body}    def run(state, "))
    said = underfoot("render", "hum.json", "-o", "a.wav", "--run-code")
    assert (said.status, said.error) == (1, f"underfoot: {own_node.file}: sizes of Hum cannot be made: {says}\n")


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("tail = 'forever'", "tail of Hum is 'forever'; allowed: a number from 0 to math.inf, or a function"),
        ("tail = -1.0", "tail of Hum is -1.0; allowed: a number from 0 to math.inf, or a function"),
        ("state = 3", "state of Hum is 3; allowed: a Layout"),
        ("coefficients = 'q'", "coefficients of Hum is 'q'; allowed: a Layout"),
    ],
)
def test_a_declaration_of_another_kind_is_one_line(underfoot, folder, own_node, line, says):
    own_node.file.write_text(own_node.file.read_text().replace("    def run(", f"    {line}\n\n    def run("))
    said = underfoot("render", "hum.json", "-o", "a.wav", "--run-code")
    assert (said.status, said.error) == (1, f"underfoot: {own_node.file} cannot be run: BadValue: {says}\n")


def test_distributions_that_cannot_be_drawn_are_one_line(underfoot, folder, own_node):
    text = own_node.file.read_text()
    own_node.file.write_text(
        text.replace("    def run(", "    def distributions(values):\n        1 / 0\n\n    def run(")
    )
    said = underfoot("distribution", "hum.json", "--run-code")
    says = "distributions of Hum cannot be made: ZeroDivisionError: division by zero"
    assert (said.status, said.error) == (1, f"underfoot: {own_node.file}: {says}\n")
