"""Tables of conditions: a line is a stimulus, and each mistake in one is a line that names its place."""

import msgspec
import pytest
from made_patches import patch_of
from made_studies import TD, made_protocol, preset_protocol, protocol_text

from underfoot.errors import BadFile
from underfoot.experiments.conditions import read_conditions, with_conditions
from underfoot.experiments.draft import Draft
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.stimuli import Stimulus
from underfoot.patch import preset_files

TABLE = """stimulus,like,level_m_s2,stiffness_n_mm,place
soft,TD,0.2,60,heel
loud,TD,0.6,,toe
none,,,60,toe
"""


def table(folder, text=TABLE):
    path = folder / "trials.csv"
    path.write_text(text)
    return path


def refused(folder, text):
    """What is said of a table, without the name of its file."""
    draft = Draft.of(made_protocol("rating"), folder)
    with pytest.raises(BadFile) as refusal:
        read_conditions(table(folder, text), draft)
    return str(refusal.value).removeprefix(str(folder / "trials.csv"))


@pytest.mark.parametrize("behind", ["", ",,"])
def test_each_line_is_a_stimulus_with_its_level_plate_and_factors(tmp_path, behind):
    """Also with columns of nothing behind them, as spreadsheets write them where there was something once."""
    text = TABLE.replace("\n", f"{behind}\n")
    made, _ = with_conditions(made_protocol("rating"), tmp_path, table(tmp_path, text))
    assert list(made.stimuli) == ["soft", "loud", "none"]
    soft, loud, none = made.stimuli.values()
    assert (soft.patch, soft.measured_m_s2, soft.level_m_s2, soft.stiffness_n_mm) == ("stimulus-td", 6.8, 0.2, 60.0)
    assert (loud.level_m_s2, loud.stiffness_n_mm, loud.factors) == (0.6, 0.0, {"place": "toe"})
    assert (none.patch, none.level_m_s2, none.factors) == ("", 0.0, {"place": "toe"})
    assert made.stages[0].method.parameters["rated"] == ["soft", "loud", "none"]


def test_a_standard_that_a_stage_names_alone_stays(tmp_path):
    parameters = {"standard": "TD", "comparisons": ["A"]}
    protocol = made_protocol("constant-stimuli", parameters, {"TD": TD, "A": {**TD, "level_m_s2": 0.1}, "B": {}})
    made, _ = with_conditions(protocol, tmp_path, table(tmp_path))
    assert list(made.stimuli) == ["TD", "soft", "loud", "none"]
    assert made.stages[0].method.parameters == {"standard": "TD", "comparisons": ["soft", "loud", "none"]}


def test_semicolons_settings_of_the_patch_and_lines_without_a_name(tmp_path):
    path = table(tmp_path, "patch;gain.gain;strong\nstimulus-td;0.5;true\n;;\nstimulus-td;0.25;false\n")
    made, _ = with_conditions(made_protocol("rating"), tmp_path, path)
    assert {name: one.factors for name, one in made.stimuli.items()} == {
        "c1": {"strong": "true"},
        "c3": {"strong": "false"},
    }
    played = [stimulus.at(0.0).node("gain").parameters["gain"] for stimulus in made.stimuli.values()]
    assert played == [0.5, 0.25]


@pytest.mark.parametrize("separator", ";\t")
def test_a_decimal_comma_is_read_where_cells_have_another_separator(separator, tmp_path):
    """A spreadsheet in French wrote 0,5: a factor of words, along which there is no curve, and no level at all."""
    text = "patch;gain.gain;depth;place\nstimulus-td;0,5;-1,25E-1;1,2 m\nstimulus-td;1;2;b, c\n"
    path = table(tmp_path, text.replace(";", separator))
    made, _ = with_conditions(made_protocol("rating"), tmp_path, path)
    assert made.stimuli["c1"].settings == {"gain.gain": 0.5}
    assert made.stimuli["c1"].factors == {"depth": -0.125, "place": "1,2 m"}
    assert made.stimuli["c2"].factors == {"depth": 2, "place": "b, c"}


def test_a_patch_beside_the_table_is_copied_beside_the_draft(tmp_path):
    tables, own = tmp_path / "tables", tmp_path / "own"
    tables.mkdir()
    (tables / "mine.json").write_bytes(preset_files.patches()["stimulus-td"].read_bytes())
    draft = Draft.of(preset_protocol("compliance-rating"), own)
    draft.take_conditions(read_conditions(table(tables, "stimulus,patch\na,mine.json\n"), draft))
    assert draft.checked().stimuli["a"].patch == "patches/mine.json"
    assert (own / "patches" / "mine.json").read_bytes() == (tables / "mine.json").read_bytes()


def test_a_table_in_another_folder_keeps_the_patches_of_the_protocol_where_they_are(tmp_path):
    """A standard beside the protocol was sought beside the table."""
    study, tables = tmp_path / "study", tmp_path / "tables" / "first"
    for folder in (study, tables):
        folder.mkdir(parents=True)
        patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "ice.wav"}).save(folder / "p.json")
    snow = {"patch": "p.json", "settings": {"wav-player.file": "snow.wav"}}
    parameters = {"standard": "plain", "comparisons": ["snow"]}
    use = {"kind": "constant-stimuli", "parameters": parameters}
    text = protocol_text(
        stimuli={"plain": {"patch": "p.json"}, "snow": snow}, stages=[{"id": "main", "kind": "trials", "method": use}]
    )
    protocol = Protocol.loads(text, "", study)
    path = table(tables, "stimulus,like,patch,wav-player.file\na,snow,,\nb,,p.json,\nc,,p.json,snow.wav\n")
    made, folder = with_conditions(protocol, study, path)
    played = {name: one.at(0.0, folder).node("wav-player").parameters for name, one in made.stimuli.items()}
    assert {name: of["file"] for name, of in played.items()} == {
        "plain": str(study / "ice.wav"),
        "a": str(study / "snow.wav"),
        "b": str(tables / "ice.wav"),
        "c": str(tables / "snow.wav"),
    }
    assert sorted(path.name for path in tmp_path.rglob("*")) == [
        "first", "p.json", "p.json", "study", "tables", "trials.csv"
    ]  # fmt: skip


def test_a_copy_of_a_study_reads_the_sound_files_that_its_settings_name(tmp_path):
    there, own = tmp_path / "there", tmp_path / "own"
    there.mkdir()
    patch_of(("wav-player.out", "tile-output.acceleration")).save(there / "p.json")
    ice = {"patch": "p.json", "settings": {"wav-player.file": "ice.wav"}}
    protocol = Protocol.loads(protocol_text(stimuli={"ice": ice, "X": {}}), "", there)
    draft = Draft.of(protocol, own)
    draft.take_patches(there)
    played = draft.checked().stimuli["ice"].at(0.0, own)
    assert played.node("wav-player").parameters["file"] == str(there / "ice.wav")


def test_each_mistake_is_one_line_with_its_place(tmp_path):
    assert refused(tmp_path, "stimulus,like\na,XX\n") == (
        ", line 2: like is 'XX'; allowed: a stimulus of the protocol (TD, X)"
    )
    assert refused(tmp_path, "stimulus,like,level_m_s2\na,TD,0.1\nb,TD,loud\n") == (
        ", line 3: level_m_s2 is 'loud'; allowed: a number"
    )
    assert ", line 3: stimulus is 'a'; allowed: letters, digits, - and _, each name once" in refused(
        tmp_path, "stimulus,like\na,TD\na,TD\n"
    )
    assert ", line 2: a.settings is 'gain.gian'; allowed: parameters of the patch: " in refused(
        tmp_path, "stimulus,like,gain.gian\na,TD,0.4\n"
    )
    assert ", line 2: a.level_m_s2 is 30.0; allowed: up to limit_m_s2, 20" in refused(
        tmp_path, "stimulus,like,level_m_s2\na,TD,30\n"
    )
    assert ", line 2: measured_m_s2 of c1 is missing" in refused(tmp_path, "like,gain.gain,level_m_s2\nTD,0.4,0.2\n")
    assert ", line 2: there is no patch 'nope'" in refused(tmp_path, "stimulus,patch\na,nope\n")
    assert ", line 2: patch is '../a.json'" in refused(tmp_path, "stimulus,patch\na,../a.json\n")
    assert ", line 1: a column is 'trial', which every table of trials has itself" in refused(tmp_path, "trial\n1\n")
    assert ", line 1: a column is 'like'; allowed: a name for each column, each once" in refused(
        tmp_path, "like,like\nTD,TD\n"
    )
    assert ": line 2 has 1 column; allowed: 2 as in line 1" in refused(tmp_path, "stimulus,like\na\n")
    assert ": line 2 has 3 columns; allowed: 2 as in line 1" in refused(tmp_path, "stimulus,like,\na,TD,0.2\n")
    assert ", line 1: a column is ''; allowed: a name for each" in refused(tmp_path, "stimulus,,like\na,,TD\n")
    assert " has no conditions" in refused(tmp_path, "")
    for data, said in ((b"PK\x03\x04\xff", "save its sheet as CSV"), (bytes(1000), "save it as CSV, UTF-8")):
        (tmp_path / "trials.csv").write_bytes(data)
        with pytest.raises(BadFile, match=said):
            read_conditions(tmp_path / "trials.csv", Draft.of(made_protocol("rating"), tmp_path))


def test_what_is_copied_beside_a_study_reads_the_same_sound_files(tmp_path):
    """A patch, and the files that a table names."""
    there, own = tmp_path / "sounds", tmp_path / "protocols"
    there.mkdir()
    player = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "ice.wav"})
    player.save(there / "player.json")
    draft = Draft.new(own)
    text = "stimulus,patch,wav-player.file\nice,player.json,\nsnow,player.json,snow.wav\n"
    found = read_conditions(table(there, text), draft)
    assert found["ice"]["patch"] == found["snow"]["patch"] == "patches/player.json"
    for name, one in found.items():
        patch = msgspec.convert(one, Stimulus).at(0.0, own)
        assert patch.node("wav-player").parameters["file"] == str(there / f"{name}.wav")
