"""`underfoot experiment` and `underfoot analyse`, as they are typed."""

import csv
import json
import re
import resource
import subprocess
import sys
import time
from contextlib import closing
from functools import partial

import numpy as np
import pytest
from click.testing import CliRunner
from command_line import COMPILING
from loud_language import NAME, unsaid, write_loud_language
from made_studies import TD, made_protocol, preset_protocol, protocol_text
from msgspec import structs
from wired import ends

from underfoot.__main__ import cli
from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.replay import Replay
from underfoot.experiments.observers import SimulatedParticipant
from underfoot.experiments.protocol import Protocol, Stage
from underfoot.experiments.questions import Question
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Study
from underfoot.experiments.table import columns_of
from underfoot.experiments.trial_files import write_csv
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor
from underfoot.patch import preset_files

pytest.importorskip("statsmodels")


def run(*arguments):
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def said(*arguments):
    """What a command refuses with, in one line."""
    result = run(*arguments)
    assert result.exit_code != 0
    return str(result.exception)


def in_terminal(command, typed, printed):
    """The exit status of a command, each of whose lines is `typed` once what it waits for was printed.

    A line may be a function of the process that returns it. What is printed is added to `printed`.
    """
    left = iter(typed)
    with subprocess.Popen(
        [sys.executable, "-u", "-m", "underfoot", *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as child:
        waits, line = next(left)
        for text in child.stdout:
            printed.append(text)
            if waits and waits in text:
                child.stdin.write(f"{line(child) if callable(line) else line}\n")
                child.stdin.flush()
                waits, line = next(left, ("", ""))
    return child.returncode


def made_session(path, name="detection-threshold", person=0, id="", protocol=None):
    """A session file that a simulated participant has answered, of a preset or of a protocol."""
    protocol, id = protocol or preset_protocol(name), id or f"P{person + 1}"
    file = SessionFile.create(path, protocol, id, preset_files.protocols()[name].parent)
    participant = SimulatedParticipant(protocol, {}, np.random.default_rng(person))
    study = Study(protocol, id)
    while not study.is_done:
        file.add(study.answer(participant.answer(study.page)))
    file.close()
    return path


def test_a_simulated_study_is_a_table_and_a_page_with_pictures(tmp_path):
    one = run("experiment", "detection-threshold", "--simulate", 45, "--json", "--processes", 1, "--report", tmp_path)
    (findings,) = json.loads(one.stdout)
    table, people = findings["tables"]  # what was found, and who was simulated
    (row,) = table["rows"]
    assert row[table["columns"].index("estimate")] == "threshold TD"
    assert abs(row[table["columns"].index("bias")]) < 0.5
    assert "spread_db" in [row[0] for row in people["rows"]]
    text = (tmp_path / "power.html").read_text()
    assert text.count("<svg") == 2


def test_trials_of_simulated_people_are_written_and_analysed_like_those_of_people(tmp_path):
    table = tmp_path / "trials.csv"
    arguments = ("experiment", "identification-impact", "--simulate", 2, "--processes", 1, "--csv", table)
    assert run(*arguments).exit_code == 0
    assert [line[:3] for line in table.read_text().splitlines()[1:]] == [*["S1,"] * 96, *["S2,"] * 96]
    assert "S2" in run("analyse", table).output


def test_the_trials_of_a_participant_are_printed_and_written_beforehand(tmp_path):
    printed = run("experiment", "identification-impact", "--plan", "P01", "--csv", tmp_path / "plan.csv").output
    with (tmp_path / "plan.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [list(row)[:5] for row in rows[:1]] == [["stage", "block", "trial", "condition", "stimulus"]]
    lines = [line.split()[:3] for line in printed.splitlines() if line.split()[:1] == ["main"]]
    assert lines == [[row["stage"], row["block"], row["trial"]] for row in rows]
    assert len(rows) == 96
    assert "P01" in printed
    assert "participant is 'P 1'; allowed: an id" in said("experiment", "free-labels", "--plan", "P 1")


def test_two_processes_give_the_same_table_as_one():
    tables = [run("experiment", "detection-threshold", "--simulate", 50, "--processes", n).stdout for n in (1, 2)]
    assert tables[0] == tables[1]
    assert "threshold TD" in tables[0]


def test_sessions_are_analysed_exported_and_read_again(tmp_path):
    paths = [made_session(tmp_path / f"p{k}.session", person=k) for k in range(3)]
    done = run("analyse", *paths, "--csv", tmp_path / "t.csv", "--bids", tmp_path / "b", "--report", tmp_path / "r")
    assert done.exit_code == 0, done.exception
    assert "threshold TD" in done.stdout
    assert "0.46 m/s^2" in done.stdout  # the thesis's, beside
    assert (tmp_path / "r" / "analysis.html").read_text().count("<svg") == 4  # of each, and of all
    for path in (tmp_path / "t.csv", *paths):  # the answers of people
        before = path.read_bytes()
        assert "is given twice" in said("analyse", path, "--csv", path)
        assert path.read_bytes() == before
    again = run("analyse", tmp_path / "t.csv")
    assert [line for line in again.stdout.splitlines() if "threshold" in line] == [
        line for line in done.stdout.splitlines() if "threshold" in line
    ]
    sidecar = json.loads((tmp_path / "b/sub-P1/beh/sub-P1_task-DetectionthresholdofstimulusTD_beh.json").read_text())
    table = (tmp_path / "b/sub-P1/beh/sub-P1_task-DetectionthresholdofstimulusTD_beh.tsv").read_text().splitlines()
    columns = table[0].split("\t")
    assert {"level_m_s2", "felt", "trial"} <= set(columns) <= set(sidecar)
    assert all(len(line.split("\t")) == len(columns) for line in table)


def test_two_people_whose_ids_were_exchanged_get_their_own_and_keep_their_orders(tmp_path):
    """Levels and order stay those that each was presented; a table had the one's answers under the other's id."""
    protocol = made_protocol("rating", {"blocks": 1, "order": "counterbalanced"}, {"TD": TD, "X": {}, "Y": {}})
    paths = [made_session(tmp_path / f"P{k}.session", id=f"P{k}", protocol=protocol) for k in (1, 2)]
    run("analyse", *paths, "--csv", tmp_path / "a.csv")
    assert run("experiment", paths[0], "--correct-id", "P2").stdout == "P1 is P2 in tables\n"
    assert f"is P2's session, and so is {paths[0]}; analyse one of them" in said("analyse", *paths)
    assert run("experiment", paths[1], "--correct-id", "P1").exit_code == 0
    done = run("analyse", *paths, "--csv", tmp_path / "b.csv", "--bids", tmp_path / "b", "--json")
    before, after = (list(csv.DictReader((tmp_path / name).read_text().splitlines())) for name in ("a.csv", "b.csv"))
    other = {"P1": "P2", "P2": "P1"}
    assert after == [{**row, "participant": other[row["participant"]]} for row in before]
    assert len({row["block_row"] for row in after}) == 2
    notes = [(row[0], row[3]) for row in json.loads(done.stdout)[-1]["tables"][0]["rows"]]
    assert notes == [(now, f"id corrected to {now}; begun as {begun}") for begun, now in other.items()]
    assert {path.name for path in (tmp_path / "b").glob("sub-*")} == {"sub-P1", "sub-P2"}
    assert "participant is 'a b'; allowed: an id" in said("experiment", paths[0], "--correct-id", "a b")


def test_a_session_that_is_left_out_with_a_reason_counts_nowhere_and_is_named_everywhere(tmp_path):
    """Whoever misunderstood the task was left out by moving the file away, and nobody knew of it or why."""
    asked = Stage(
        id="after", kind="questions", questions=(Question("ease", "Was it easy?", "choice", options=("a", "b")),)
    )
    made = made_protocol("rating", {"blocks": 1, "rated": ["TD"]})
    protocol = structs.replace(made, stages=(*made.stages, asked))
    (tmp_path / "p.json").write_bytes(protocol.dumps())
    paths = [made_session(tmp_path / f"P{k}.session", id=f"P{k}", protocol=protocol) for k in (1, 2, 3)]
    before = run("analyse", *paths[:2], "--bids", tmp_path / "b0").stdout
    assert run("experiment", paths[2], "--leave-out", "wore\n ski  boots").stdout == "P3 is left out: wore ski boots\n"
    table, page = tmp_path / "t.csv", tmp_path / "r"
    done = run("analyse", *paths, "--csv", table, "--bids", tmp_path / "b", "--report", page, "--json")
    assert done.exit_code == 0, done.exception
    rating, questions, noted = json.loads(done.stdout)
    assert rating["remarks"][-1] == "Left out by the experimenter: P3 (wore ski boots)."
    assert not any("spoiled" in remark for remark in rating["remarks"])
    assert sum(row[1] for row in questions["tables"][0]["rows"]) == 2
    assert noted["tables"][0]["rows"][0][3] == "left out of the analysis: wore ski boots"
    lines = list(csv.DictReader(table.read_text().splitlines()))
    assert [line["spoiled"] for line in lines] == ["", "", "left out: wore ski boots"]
    people = [line.split("\t") for line in (tmp_path / "b" / "participants.tsv").read_text().splitlines()]
    assert [line[-1] for line in people] == ["left_out", "n/a", "n/a", "wore ski boots"]
    assert "left_out" in json.loads((tmp_path / "b" / "participants.json").read_text())
    assert "left_out" not in (tmp_path / "b0" / "participants.tsv").read_text()
    text = (page / "analysis.html").read_text()
    assert "P1, P2<" in text
    assert "P3 (wore ski boots)<" in text
    again = run("analyse", table, "--protocol", tmp_path / "p.json").stdout
    assert "Left out by the experimenter: P3 (wore ski boots)." in again
    nobody = "nobody else has answered a trial than who is left out: P3 (wore ski boots)"
    assert said("analyse", paths[2]) == nobody
    assert run("experiment", paths[2], "--leave-out", "").stdout == "P3 counts\n"
    assert "Left out" not in run("analyse", *paths).stdout
    assert run("analyse", *paths[:2]).stdout == before
    assert "is no session file; only such" in said("experiment", tmp_path / "p.json", "--leave-out", "x")


def test_a_table_is_analysed_with_the_parameters_of_its_protocol(tmp_path):
    """Where a staircase turns depends on its rule, and its threshold on how many turns count."""
    text = json.loads(preset_files.protocols()["detection-threshold"].read_text())
    text["stages"][2]["method"]["parameters"] |= {"down_after": 3, "reversals": 8, "last": 4}
    study, table = tmp_path / "three-down.json", tmp_path / "trials.csv"
    study.write_text(json.dumps(text))
    session = made_session(tmp_path / "P1.session", protocol=Protocol.load(study))
    of_session, alone, known = (
        run("analyse", *arguments).stdout
        for arguments in ((session, "--csv", table), (table,), (table, "--protocol", study))
    )
    thresholds = [[line for line in out.splitlines() if "threshold TD" in line] for out in (of_session, alone, known)]
    assert thresholds[0] == thresholds[2] != thresholds[1]
    assert "come without their protocol: analysed with the method's usual parameters" in alone
    assert "come without their protocol" not in of_session + known
    assert "there is no protocol 'none'" in said("analyse", table, "--protocol", "none")


def test_levels_that_a_table_lacks_are_those_of_its_protocol(tmp_path):
    """Beside silence curves begin at the half that is guessed; without levels they were fitted as if they did not."""
    db = {f"s{k}": {**TD, "level_m_s2": 0.43 * 10.0 ** (k / 20.0), "factors": {"db": k}} for k in range(-12, 13, 4)}
    parameters = {"comparisons": list(db), "standard": "X", "blocks": 8}
    protocol = made_protocol("constant-stimuli", parameters, {**db, "X": {}})
    study, whole, less = tmp_path / "study.json", tmp_path / "whole.csv", tmp_path / "less.csv"
    study.write_bytes(protocol.dumps())
    rows, _ = simulated_rows(protocol, 0, 1, {})
    write_csv(whole, rows)
    write_csv(less, rows, [name for name in columns_of(rows) if name != "level_m_s2"])
    curves = [run("analyse", table, "--protocol", study, "--bootstrap", 0).stdout for table in (whole, less)]
    assert "threshold" in curves[0]
    assert curves[1] == curves[0]
    alone = run("analyse", less, "--bootstrap", 0).stdout
    assert "These trials have no column level_m_s2: analysed as if the standard vibrates." in alone


def test_ids_that_differ_in_letter_case_only_are_refused_or_remarked_on(tmp_path):
    paths = [tmp_path / id / f"{id}.session" for id in ("P01", "p01")]
    for path in paths:
        path.parent.mkdir()
        made_session(path, id=path.stem)
    done = run("analyse", *paths)
    assert done.exit_code == 0, done.exception
    assert "P01 and p01 differ in letter case only, and are counted as 2 participants." in done.stdout
    assert "the same id without signs and letter case" in said("analyse", *paths, "--bids", tmp_path / "b")
    session = tmp_path / "P01" / "p01.session"
    refused = said("experiment", "detection-threshold", "--participant", "p01", "--session", session)
    assert "p01.session differs from P01.session in letter case only" in refused
    assert [path.name for path in session.parent.iterdir()] == ["P01.session"]


def fill_disk(typed, child):
    """Let no file of the process grow, and type something."""
    resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
    return typed


def make_room(child):
    resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    return ""


def end(child):
    child.terminate()
    return ""


def test_a_study_is_run_in_a_terminal(tmp_path):
    """Trials begun by Enter and answered by typing; a line that cannot be is said again; then a signal ends it.

    What a full disk refuses, an answer or a pause that ends by itself, is written when there is room; a note is typed
    again.
    """
    stages = [
        {"id": "consent", "kind": "consent", "text": "You can stop at any time."},
        {"id": "rest", "kind": "pause", "seconds": 1.0},
        {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}},
    ]
    protocol = tmp_path / "a.json"
    protocol.write_text(protocol_text(stages=stages, stimuli={"TD": TD, "X": {}}, present_s=0.1))
    command = ["experiment", str(protocol), "--participant", "P7", "--session", str(tmp_path / "p7.session")]
    typed = (
        ("agree", "yes"),
        ("Pause of 1 s", partial(fill_disk, "")),
        ("When it can be written, press Enter", make_room),
        ("press Enter to begin", ""),
        ("How strong was it", partial(fill_disk, "note tired")),
        ("Type it again when it can be written", lambda child: f"note tired{make_room(child)}"),
        ("How strong was it", "much"),
        ("allowed: 0 (least) to 100", partial(fill_disk, "40")),
        ("When it can be written, press Enter", ""),
        ("When it can be written, press Enter", make_room),
        ("press Enter to begin", ""),
        ("How strong was it", end),
    )
    printed = []
    assert in_terminal(command, typed, printed) == 143
    assert "How strong was it" in "".join(printed).rstrip().splitlines()[-1]  # nothing of memory that was left
    assert "You can stop at any time.\n" in printed  # a page without a title
    file = SessionFile.open(tmp_path / "p7.session")
    begun = {}
    assert [entry.answers for entry in file.entries()] == [{"agreed": "yes"}, {}, {"rating": 40.0}, begun]
    assert [note.text for note in file.notes()].count("tired") == 1
    file.close()


def test_a_pilot_in_a_terminal_has_two_trials_a_stage_in_the_studys_language_and_lies_apart(typing, tmp_path):
    write_loud_language(tmp_path)
    felt = {"id": "felt", "kind": "trials", "start": "step", "practice": True, "text": "STEP, AND SAY WHAT YOU FELT"}
    felt["method"] = {"kind": "staircases", "parameters": {"followed": ["TD"], "empty_every": 2}}
    rated = {"id": "rated", "kind": "trials", "method": {"kind": "rating", "parameters": {}}}
    equal = {"kind": "adjustment", "parameters": {"followed": ["TD"], "standard": "S"}}
    moved = {"id": "moved", "kind": "trials", "start": "step", "method": equal}
    others = ({"id": id, "kind": id, "stimulus": "TD"} for id in ("consent", "level", "read", "learn"))
    rest = {"id": "rest", "kind": "pause", "seconds": 5}
    study = {"stages": [*others, felt, rated, moved, rest], "stimuli": {"TD": TD, "S": TD}, "present_s": 0.1}
    (tmp_path / "a.json").write_text(protocol_text(**study, language=NAME))
    lowered = (("JUST FEEL IT", ""), ("MOVE IT TO", "++"), ("NO FURTHER", "--"), ("ENTER KEEPS IT", "-"))
    stepped = (("ENTER STEPS", ""), ("DID YOU FEEL", "YES"), ("ENTER STEPS", ""), ("DID YOU FEEL", "2"))
    first = (("TRIAL 1: PRESS ENTER", ""), ("HOW STRONG WAS IT", "MUCH"), ("THE ANSWER", "40,5"))
    second = (("TRIAL 2", ""), ("(LEAST) TO", "60"))
    compared = (("THE ONE TO SET.", "o"), ("THE ONE TO COMPARE WITH.", "-"), ("THE ONE TO SET.", ""))
    adjusted = (("ENTER STEPS", ""), ("o TO FEEL THE OTHER ONE", "X"), ("IS NO STEP", "--"), *compared)
    typed = (("(YES, NO)", "Y"), *lowered, ("ENTER KEEPS IT", ""), ("ENTER TO GO ON", ""), ("A NUMBER", "3"),
             ("THE ANSWER", ""), *stepped, *first, *second, *adjusted, *adjusted, ("ENDS IT", "skip"))  # fmt: skip
    printed = typing(["experiment", tmp_path / "a.json", "--pilot"], typed)
    help, *said, kept = printed
    assert (help.split()[:2], kept.split()[:2]) == (["Type", "stop"], ["The", "pilot"])  # to the experimenter
    assert [line for line in said if re.search("dB|TD", line) or unsaid(re.sub(r"\b(skip|o)\b", "", line))] == []
    assert "STEP, AND SAY WHAT YOU FELT. PRACTICE. TRIAL 1.\n" in said
    assert "STEP, AND SAY WHAT YOU FELT. PRACTICE: NOTHING COMES THIS TIME. TRIAL 2.\n" in said
    with closing(SessionFile.open(tmp_path / "a-pilot" / "1.session")) as file:
        agreed, level, _, _, *entries, one, other, _ = file.entries()
    assert (agreed.answers, level.answers) == ({"agreed": "yes"}, {"gain_db": -2.5})
    assert one.answers.keys() == other.answers.keys() == {"level_db"}
    assert [entry.answers for entry in entries] == [{"felt": "yes"}, {"felt": "no"}, {"rating": 40.5}, {"rating": 60.0}]
    assert all(entry.facts["most_force_n"] > 300.0 for entry in entries)


def test_that_nobody_stands_on_a_floor_of_hardware_is_said_once(typing, tmp_path):
    """In two trials; their answers and loads are kept."""
    floor, (sender, transport) = default_floor(1, 1), ends("udp")
    times = np.arange(1000) / 1000.0
    empty = Replay(ForceSeries(times, np.zeros((1000, 1, 4)), 1000.0), floor, 48_000.0, repeats=True)
    stage = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}
    (tmp_path / "a.json").write_text(protocol_text(stages=[stage], present_s=0.1))
    (tmp_path / "floor.json").write_bytes(floor.dumps())
    command = ["experiment", "a.json", "--participant", "P", "--session", "p.session", "--target", transport.name,
               "--floor", "floor.json"]  # fmt: skip
    enter = ("press Enter to begin", "")
    typed = (enter, ("How strong was it", "40"), enter, ("How strong was it", "60"))
    with closing(Emulator(sender, empty)) as emulator:
        emulator.start()
        printed = typing(command, typed)
    assert [line for line in printed if "Nobody" in line] == ["Nobody stands on the floor: 0 N.\n"]
    with closing(SessionFile.open(tmp_path / "p.session")) as file:
        assert [entry.facts["most_force_n"] for entry in file.entries()] == [0.0, 0.0]


def test_a_session_of_a_protocol_that_was_changed_goes_on_by_its_own_name(typing, tmp_path):
    """As it was begun: two trials, of which one was answered before the change; a stop at the thanks reads them."""
    protocol, session = tmp_path / "a.json", tmp_path / "p.session"
    stage = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}
    thanks = {"id": "thanks", "kind": "read", "text": "Thank you."}
    text = protocol_text(stages=[stage, thanks], present_s=0.1)
    protocol.write_text(text)
    file = SessionFile.create(session, Protocol.loads(text), "P", tmp_path)
    file.add(file.study(Protocol.loads(text)).answer({"rating": 40.0}))
    file.close()
    protocol.write_text(protocol_text(present_s=0.2))
    refused = said("experiment", protocol, "--participant", "P", "--session", session)
    assert refused.endswith(f"go on with that one (underfoot experiment {session}), or begin a new session")
    goes_on = f"--pilot is given with {session}, a session that goes on as it was begun; allowed: --target, --floor"
    assert said("experiment", session, "--pilot").startswith(goes_on)
    with closing(SessionFile.open(session)) as other:
        other.hold()  # the trigger was opened first, though another window may use it with the session
        held = said("experiment", session, "--trigger", tmp_path / "no port")
        assert held.endswith("is gone on with in another window or terminal; end it there first")
    new = tmp_path / "q.session"
    for arguments in ((session,), (protocol, "--participant", "Q", "--session", new)):
        assert said("experiment", *arguments, "--trigger", tmp_path / "no port").endswith("there is no such port")
    assert not new.exists()  # it was left, empty
    typed = (("press Enter to begin", ""), ("How strong was it", "60"), ("Press Enter to go on", "stop"))
    typing(["experiment", session], typed)
    file = SessionFile.open(session)
    assert [entry.answers for entry in file.entries()] == [{"rating": 40.0}, {"rating": 60.0}, {}]
    file.close()


def test_conditions_of_a_table_are_simulated(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("stimulus,like,level_m_s2\nsoft,TD,0.2\nloud,TD,0.6\n")
    arguments = ("experiment", "detection-threshold", "--simulate", 2, "--processes", 1, "--conditions")
    assert {"soft", "loud"} <= set(run(*arguments, path).stdout.split())
    path.write_text("stimulus,like,level_m_s2\nsoft,TD,faint\n")
    assert f"{path}, line 2: level_m_s2 is 'faint'; allowed: a number" in said(*arguments, path)


def test_what_cannot_be_is_one_line(tmp_path):
    assert "there is no protocol 'nope'; allowed: a file, or" in said("experiment", "nope", "--simulate", 3)
    assert "p01.session cannot be read: no such file" in said("experiment", "p01.session")
    assert "p01.session cannot be read: no such file" in said("analyse", "p01.session")
    assert "give one of --participant" in said("experiment", "free-labels")
    assert "people is 0; allowed: 1 to" in said("experiment", "free-labels", "--simulate", 0)
    assert "--truth is 'x'" in said("experiment", "free-labels", "--simulate", 2, "--truth", "x")
    assert "--participant needs --session FILE" in said("experiment", "free-labels", "--participant", "P1")
    assert "--target is walk.csv" in said(
        "experiment", "free-labels", "--participant", "P1", "--session", tmp_path / "s", "--target", "walk.csv"
    )
    assert "cannot be read" in said("analyse", tmp_path / "none.csv")
    (tmp_path / "a.csv").write_text("a,b\n1,2\n")
    assert "has no column participant" in said("analyse", tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text("participant,method,trial\nP1,telepathy,1\n")
    assert "method is 'telepathy'; allowed: absolute-identification" in said("analyse", tmp_path / "b.csv")
    (tmp_path / "c.csv").write_text("participant,method,trial\nP1,rating,1\n")
    assert "trials of rating have no column stimulus; allowed: a table with" in said("analyse", tmp_path / "c.csv")
    (tmp_path / "d.csv").write_text("participant,method,trial\nP1,rating\n")
    assert "line 2 has 2 columns; allowed: 3 as in line 1" in said("analyse", tmp_path / "d.csv")


def test_a_study_is_not_begun_on_a_sound_card_that_is_not_there(tmp_path):
    """In a process of its own, since PortAudio looks for devices only once."""
    command = ["experiment", "free-labels", "--participant", "P1", "--session", str(tmp_path / "s"), "--sound", "nix"]
    done = subprocess.run(
        [sys.executable, "-m", "underfoot", *command], input="", capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert re.fullmatch(r"underfoot: (nix cannot be played on: .*; cards: .*|PortAudio is not there .*)\n", done.stderr)
    assert list(tmp_path.iterdir()) == []


def test_sessions_of_two_protocols_are_not_mixed(tmp_path):
    one = made_session(tmp_path / "a.session")
    other = made_session(tmp_path / "b.session", "free-labels")
    refused = said("analyse", one, other)
    assert "is of another protocol than" in refused
    assert refused.endswith("or write a CSV of each, and analyse these")


def test_levels_are_measured_under_the_simulated_footstep(tmp_path):
    preset = json.loads(preset_files.protocols()["intensity-equalisation"].read_text())["stimuli"]
    (tmp_path / "a.json").write_text(protocol_text(stimuli={name: preset[name] for name in ("SP", "TD")}))
    told = run("experiment", tmp_path / "a.json", "--levels", "--json")
    found = json.loads(told.stdout)
    assert list(found) == ["SP", "TD"]
    assert found["TD"]["measured_m_s2"] == pytest.approx(6.0, rel=0.12)  # textures differ from draw to draw; 1 dB
    measured = [line for line in told.stderr.splitlines() if not COMPILING.match(f"{line}\n")]
    assert measured == [f"underfoot: {k} of {len(found)}: {name}" for k, name in enumerate(found, 1)]


def test_measuring_levels_says_that_it_compiles(own_node):
    """A stimulus of one's own was compiled for seconds, and at first use all of them, without a line."""
    own_node.write(f"1.{time.time_ns()}")  # as it was never compiled
    (own_node.folder / "hum.protocol.json").write_text(protocol_text(stimuli={"hum": {"patch": "hum.json"}}))
    told = run("experiment", own_node.folder / "hum.protocol.json", "--levels", "--run-code")
    assert told.stderr.startswith("underfoot: first use: compiling kernels, which takes up to a minute\n")
    assert told.stdout.startswith("hum ")
