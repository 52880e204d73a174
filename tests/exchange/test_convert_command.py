"""`underfoot convert`, there and back."""

import json

import foreign_files as made
import pytest
from format_rules import RULES

from underfoot.exchange.formats import FORMATS
from underfoot.exchange.losses import losses
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

SINE = preset_files.patches()["stimulus-sp"]


@pytest.mark.parametrize("name", RULES)
def test_a_patch_goes_out_and_comes_back_with_all_that_was_lost_told(underfoot, folder, name):
    out = folder / f"sine{FORMATS[name].suffix}"
    said = underfoot("convert", SINE, "-o", out)
    assert said.status == 0, said.error
    RULES[name](json.loads(out.read_text()))
    lines = [line.strip() for line in said.out.splitlines()]
    assert "envelope within" in said.out
    assert lines[lines.index("not kept:") + 1 :] == list(losses(Patch.load(SINE, REGISTRY), FORMATS[name].carries))
    back = underfoot("convert", out, "-o", "back.json")
    assert back.status == 0, back.error
    assert back.out.splitlines()[-1] == "all is kept"
    assert Patch.load(folder / "back.json", REGISTRY).nodes


@pytest.mark.parametrize("name", made.SAMPLES)
def test_files_of_other_programs_become_patches_by_their_suffix_or_what_they_begin_with(underfoot, folder, name):
    path = made.put(folder, name)
    assert underfoot("convert", path, "-o", "patch.json").status == 0
    assert underfoot("convert", path, "-o", "again.json", "--format", name).status == 0
    assert (folder / "patch.json").read_bytes() == (folder / "again.json").read_bytes()


def test_a_sound_is_named_from_the_folder_of_the_patch_and_handed_on_with_it(underfoot, folder):
    made.put(folder, "wav")
    assert underfoot("convert", "sound.wav", "-o", "patch.json").status == 0
    assert Patch.load("patch.json", REGISTRY).node("wav-player").parameters["file"] == "sound.wav"
    assert underfoot("convert", "patch.json", "-o", "to/shared").status == 0
    (folder / "sound.wav").unlink()
    assert underfoot("render", "to/shared/patch.json", "-o", "a.wav", "--seconds", 0.2).status == 0


def test_the_formats_are_listed_with_what_they_lose(underfoot):
    said = underfoot("convert", "--formats")
    assert said.status == 0
    for format in FORMATS.values():
        assert f"{format.name} " in said.out
        assert format.label in said.out


def test_what_cannot_be_converted_is_one_line(refused, folder):
    (folder / "a.xyz").write_text("x")
    (folder / "b.json").write_text('{"x": 1}')
    (folder / "c.haptic").write_text("{}")
    assert "allowed: .ahap, .haptic" in refused("convert", "a.xyz", "-o", "p.json")
    assert "b.json does not look like macaron or syntacts" in refused("convert", "b.json", "-o", "p.json")
    assert "allowed: 'underfoot-patch'" in refused("convert", "b.json", "-o", "p.haptic")
    assert "version, major is null; allowed: 1" in refused("convert", "c.haptic", "-o", "p.json")
    assert "allowed: a name that ends in .json" in refused("convert", "c.haptic", "-o", "p.wav")
    assert "is of no format that can be written" in refused("convert", SINE, "-o", "p.xyz")
    assert "--format is 'x'; allowed: " in refused("convert", SINE, "-o", "p.wav", "--format", "x")
    assert "IN or -o OUT is missing" in refused("convert")
    assert "no such file" in refused("convert", "missing.haptic", "-o", "p.json")
    for seconds in ("nan", "0", "-1", "1e6"):  # of which the last took all memory there is
        said = refused("convert", SINE, "-o", "p.haptic", "--seconds", seconds)
        assert f"seconds is {float(seconds)}; allowed: above 0, up to 600 s" in said
    assert "--tile is 'x'; allowed: t1" in refused("convert", SINE, "-o", "p.wav", "--tile", "x")
    assert "there is no folder" in refused("convert", SINE, "-o", "no/p.wav")
