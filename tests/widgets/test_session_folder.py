"""Where the sessions of a study lie: two studies whose files have the same name do not mix."""

import shutil

import pytest
from made_studies import protocol_text

from underfoot.patch import preset_files
from underfoot.widgets.experiment.studies import STUDY, SessionFolder, load_study, preset_studies


@pytest.fixture
def sessions(tmp_path):
    return SessionFolder(tmp_path / "studies")


@pytest.fixture
def study(tmp_path):
    def made(folder):
        path = tmp_path / folder / "protocol.json"
        path.parent.mkdir(exist_ok=True)
        path.write_text(protocol_text(title=folder))
        return load_study(path)

    return made


def begin(sessions, study, participant):
    sessions.claim(study)
    sessions.path(study, participant).touch()


def test_two_protocols_of_one_name_in_two_folders_have_sessions_of_their_own(sessions, study):
    """P01 of the second was asked to go on with the first."""
    gravel, sand = study("gravel"), study("sand")
    for one in (gravel, sand, gravel.pilot(), sand.pilot()):
        assert sessions.files(one) == []
        begin(sessions, one, "P01")
    found = [path.relative_to(sessions.root).as_posix() for one in (gravel, sand) for path in sessions.files(one)]
    assert found == ["protocol/P01.session", "protocol-2/P01.session"]
    assert sessions.files(sand.pilot()) == [sessions.root / "protocol-pilot-2" / "P01.session"]


def test_a_protocol_that_was_moved_keeps_its_sessions(sessions, study, tmp_path):
    begin(sessions, study("gravel"), "P01")
    shutil.move(tmp_path / "gravel", tmp_path / "sand")
    moved = load_study(tmp_path / "sand" / "protocol.json")
    assert [path.name for path in sessions.files(moved)] == ["P01.session"]
    begin(sessions, moved, "P02")
    assert sessions.files(study("gravel")) == []  # another study, made later where the first one was


@pytest.mark.parametrize("there", ["/home/ann/sand/protocol.json", r"C:\Users\ann\sand\protocol.json"])
def test_sessions_that_were_copied_from_another_computer_are_gone_on_with(sessions, study, there):
    """Those of the other system were another study's, so that who came back for a second day began anew."""
    gravel = study("gravel")
    begin(sessions, gravel, "P01")
    (sessions.of(gravel) / STUDY).write_text(there)
    assert [path.name for path in sessions.files(gravel)] == ["P01.session"]


def test_a_preset_has_its_sessions_wherever_the_program_lies(sessions, study, tmp_path):
    path = preset_files.protocols()["free-labels"]
    begin(sessions, load_study(path), "P01")
    assert (sessions.root / "free-labels" / "study.txt").read_text() == "free-labels.json"
    copied = tmp_path / path.name
    copied.write_bytes(path.read_bytes())
    assert sessions.files(load_study(copied)) == []


def test_presets_are_listed_without_their_patches_being_read():
    """These reads and checks would stop the window; the tests of protocols make them."""
    listed = preset_studies()
    assert [study.path for study in listed] != []
    assert all(load_study(study.path) == study for study in listed)
