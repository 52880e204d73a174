"""Where in a file something is wrong: the line that a text editor shows."""

import json
import os

import pytest

from underfoot.file_places import file_place, place_in, readable

DOCUMENT = {"format": "x", "tiles": [{"id": "a, b: {", "size": [1, 2]}, {"id": 'é"\\', "size": []}], "end": None}
"""Written over several lines; keys and texts have in them what else parts values."""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(json.dumps(DOCUMENT, indent=1))
    return path


@pytest.mark.parametrize(
    ("place", "words", "stands"),
    [
        ("$.format", "format", '"format": "x"'),
        ("$.tiles[0].size[1]", "tiles #1, size #2", "2"),
        ("$.tiles[1].id", "tiles #2, id", '"id":'),
        ("$.tiles[1].missing", "tiles #2, missing", "{"),
        ("$.end", "end", '"end": null'),
    ],
)
def test_a_place_is_told_by_its_line_and_in_words(file, place, words, stands):
    found = file_place(f"{file}: {place} is 3; allowed: text")
    assert found.in_words == f"{file}, line {found.line}: {words} is 3; allowed: text"
    assert file.read_text().splitlines()[found.line - 1].strip().startswith(stands)
    assert dict(found.excerpt())[found.line].strip().startswith(stands)


def test_what_is_no_json_has_its_line_too(file):
    file.write_text('{"a": 1,\n "b" 2}')
    found = file_place(f"{file} is not JSON: expecting ':' delimiter: line 2 column 6 (char 14)")
    assert (found.line, found.excerpt()) == (2, [(1, '{"a": 1,'), (2, ' "b" 2}')])


@pytest.mark.parametrize("text", ["", "no json", "{[}]", '{"a"', "]]]", ',,:"'])
def test_a_file_that_is_no_json_any_more_has_no_line_and_raises_nothing(file, text):
    file.write_text(text)
    assert file_place(f"{file}: $.a.b is 3").in_words.endswith("a, b is 3")


@pytest.mark.skipif(os.name != "posix", reason="only POSIX has pipes of this kind")
def test_a_pipe_in_place_of_a_file_is_not_waited_for(tmp_path):
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    for message in ("cannot be read: it is a device, and no file", "$.a.b is 3"):
        assert place_in(pipe, f"{pipe}: {message}").excerpt() == []


def test_other_errors_stay_as_they_are():
    assert readable("level is 3; allowed: 0 to 1") == "level is 3; allowed: 0 to 1"
