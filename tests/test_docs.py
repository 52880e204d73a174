"""What the documents say of the code is so: their code runs, and what they point to is there."""

import importlib.util
import os
import re
import shlex
import sys
import tomllib
from pathlib import Path

import click
import pytest
from bare_row import PlainRow
from made_frames import rows

from underfoot.__main__ import cli
from underfoot.devices.framing.wire_format import encode
from underfoot.devices.transport import Sender, Transport, made
from underfoot.devices.transport_reader import TransportReader
from underfoot.nodes import REGISTRY
from underfoot.patch.reference import reference
from underfoot.plugins import require_declared

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs").rglob("*.md"))


def blocks(page):
    """The Python code of a page, block by block."""
    return re.findall(r"^```python\n(.*?)^```", (ROOT / "docs" / page).read_text(), re.MULTILINE | re.DOTALL)


@pytest.fixture
def module_of(tmp_path):
    """`module_of(code)`: the code as a module in a file of its own."""
    made = []

    def load(code):
        path = tmp_path / f"page{len(made)}.py"
        path.write_text(code)
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules[path.stem] = module
        made.append(path.stem)
        spec.loader.exec_module(module)
        return module

    yield load
    for name in made:
        del sys.modules[name]


def test_the_node_that_is_written_on_its_page_does_what_the_page_says(module_of):
    whole_file, tried = blocks("nodes.md")
    module = module_of(whole_file)
    exec(tried, {"Tremolo": module.Tremolo})
    assert re.match(r"exact: .*\b1e-\d+", module.Tremolo.accuracy), "what every node of the program has to state"


def test_the_node_of_the_readme_is_a_whole_file_of_one_that_there_is_not(module_of):
    _, whole_file = blocks("../README.md")
    boost = module_of(whole_file).Boost
    assert boost.type not in REGISTRY
    outputs, _ = PlainRow(boost, gain=2.0).run(frame=0, n=4, signals={"signal": [1.0, 2.0, 3.0, -4.0]})
    assert list(outputs["out"]) == [2.0, 4.0, 6.0, -8.0]


def test_the_scene_that_is_written_on_its_page_does_what_the_page_says(module_of):
    whole_file, tried = blocks("scenes.md")
    module = module_of(whole_file)
    exec(tried, {"Puddle": module.Puddle})


@pytest.mark.skipif(sys.platform == "win32", reason="there are no named pipes")
def test_the_transport_that_is_written_on_its_page_carries_frames(module_of, tmp_path, until):
    whole_file, _ = blocks("plugins.md")
    module = module_of(whole_file)
    require_declared(module.Pipe, Transport)
    require_declared(module.PipeSender, Sender)
    path, heard = str(tmp_path / "pipe"), []
    os.mkfifo(path)
    sender = made("pipe", module.PipeSender.of, path)
    reader = TransportReader(
        made("pipe", module.Pipe.of, path), lambda samples, when: heard.extend(samples["sequence"])
    )
    reader.start()
    try:
        until(lambda: reader.is_open, "it is open")
        assert sender.send(encode(rows(5)), [])
        until(lambda: heard == [*range(5)], "all are read", seen=lambda: heard)
        sender.unplug()
        assert not sender.send(encode(rows(5)), [])
    finally:
        reader.close()
        sender.close()


@pytest.mark.parametrize("page", ["experiments.md", "hardware.md", "testing.md"])
def test_code_of_a_page_runs(page):
    for code in blocks(page):
        exec(code, {})


def test_the_page_on_installing_has_each_extra_and_what_it_brings():
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \|", (ROOT / "docs/install.md").read_text(), re.MULTILINE)
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert dict(rows) == {
        name: re.match(r"\w+", one)[0] for name, (one, *_) in extras.items() if name not in ("test", "docs")
    }


def anchors(page):
    """The anchors of a page's headings, as GitHub and MkDocs make them."""
    headings = re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES], ids=lambda page: page.name)
def test_a_list_has_a_blank_line_before_it_or_the_site_takes_it_for_more_of_the_paragraph(page):
    text = re.sub(r"^( *)```.*?^\1```", "", page.read_text(), flags=re.M | re.S)
    item = re.compile(r" *(- |\d+\. )")
    for first, *others in (block.split("\n") for block in re.split(r"\n{2,}", text.strip())):
        assert item.match(first) or not [line for line in others if item.match(line)], first


def test_the_tables_of_a_node_have_its_names_under_their_heads(module_of):
    pages = module_of((ROOT / "docs" / "node_pages.py").read_text())
    (low_pass,) = reference({"low-pass": REGISTRY["low-pass"]})
    _, parameters = pages.tables(low_pass)
    head, _, *rows = [[cell.strip() for cell in line[1:-1].split("|")] for line in parameters.splitlines()]
    assert head == ["parameter", "default", "allowed", ""]
    assert [row[0] for row in rows] == ["cutoff", "q"]
    assert {len(row) for row in rows} == {len(head)}


def test_the_readme_leads_to_every_page():
    table = re.findall(r"^\| \[docs/(.*)\]\(docs/\1\) \|", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert sorted(table) == sorted(page.name for page in (ROOT / "docs").glob("*.md"))


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target, anchor in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", page.read_text()):
        there = page.parent / target if target else page
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), f"{target}#{anchor}"


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.name)
def test_command_lines_have_only_commands_and_options_that_there_are(page):
    for line in re.findall(r"^    underfoot (.+)$", page.read_text(), re.MULTILINE):
        words = shlex.split(line, comments=True)
        command = cli
        while isinstance(command, click.Group) and (below := command.get_command(click.Context(command), words[0])):
            command, words = below, words[1:]
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        asked = {word.partition("=")[0] for word in words if word.startswith("-") and word != "-"}
        assert asked <= known | {"-h", "--help"}, line


@pytest.mark.parametrize("folder", ["workbench", "widgets", "tests"])
def test_what_the_code_cites_is_there(folder):
    for module in sorted((ROOT / folder).rglob("*.py")):
        for path, anchor in re.findall(r"\b(docs/[\w-]+\.md)(?:#([\w-]+))?", module.read_text()):
            assert (ROOT / path).exists(), f"{module}: {path}"
            assert not anchor or anchor in anchors(ROOT / path), f"{module}: {path}#{anchor}"


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.name)
def test_files_and_modules_that_are_named_are_there(page):
    text = page.read_text()
    for path in re.findall(r"`((?:workbench|widgets|tests|presets|docs|assets)/[\w/.-]*)`", text):
        assert (ROOT / path).exists(), path
    for name in re.findall(r"`(underfoot(?:\.\w+)+)`", text):
        parts = name.split(".")[1:]
        known = [
            (ROOT / folder).joinpath(*parts[:k]) for folder in ("workbench", ".") for k in range(1, len(parts) + 1)
        ]
        assert any(path.with_suffix(".py").exists() or path.is_dir() for path in known), name


def test_no_text_holds_a_merge_conflict():
    texts = [*ROOT.glob("*.md"), *ROOT.glob("*.toml"), *PAGES]
    assert [text.name for text in texts if re.search("^(<<<<<<<|>>>>>>>) ", text.read_text(), re.MULTILINE)] == []
