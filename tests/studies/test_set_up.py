"""What a session is made with: kept in its file, with what has changed, and told where it is no hardware."""

import re
from contextlib import closing
from importlib.metadata import version

from made_studies import made_protocol
from people import taking_part

from underfoot.engine.target import Target
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.store import SessionFile
from underfoot.floor.layout import default_floor
from underfoot.studies.results import results_of, written_files
from underfoot.studies.set_up import set_up_of

HARDWARE = Target(default_floor(1, 1), "serial", "/dev/ttyACM0", sound="hw:1")


def test_a_session_that_goes_on_with_another_set_up_says_what_has_changed(session, until, tmp_path):
    """Of another target, card, computer or version its file told nothing."""
    path, protocol = tmp_path / "a.session", made_protocol("rating", {"blocks": 1}, start="step")
    software = f"Underfoot {version('underfoot')}"
    with closing(SessionFile.create(path, protocol, "P1")) as file:
        for _ in range(2):
            file.set_up(set_up_of(HARDWARE) | {"software": "Underfoot 0.0"})
            assert file.notes() == []
    for _ in range(2):
        with taking_part(session, protocol, path, until) as person:
            known, notes = person.runner.file.about, [note.text for note in person.runner.file.notes()]
        changed = "target simulator (before: serial:ttyACM0); sound none (before: hw:1)"
        assert notes == [f"went on with another set-up: {changed}; software {software} (before: Underfoot 0.0)"]
        assert (known["target"], known["sound"], known["software"]) == ("simulator", "none", software)


def test_who_has_trials_without_hardware_is_named(session, until, tmp_path):
    """Who forgot to choose the floor, if only at first, had the simulator's forces analysed as a participant's."""
    path, protocol = tmp_path / "P1.session", made_protocol("rating", {"blocks": 2, "rated": ["TD"]}, start="step")
    with closing(SessionFile.create(path, protocol, "P1")) as file:
        file.set_up(set_up_of(HARDWARE))
        file.add(file.study(protocol).answer({"rating": 40.0}))
    told = "With simulated or replayed forces, in all trials or some, and counted: P1."
    assert told not in results_of([path]).remarks
    with taking_part(session, protocol, path, until) as person:
        person.finish_study()
    with closing(SessionFile.open(path)) as file:
        file.set_up(set_up_of(HARDWARE))
    assert [row.get("force_from") for row in results_of([path]).rows] == [None, "simulator"]
    assert results_of([path]).remarks == [told]
    results_of([path]).write_csv(tmp_path / "trials.csv")
    assert results_of([tmp_path / "trials.csv"]).remarks == [told]
    with closing(SessionFile.open(path)) as file:
        file.leave_out("a trial of ours")
    assert told not in results_of([path]).remarks


def test_the_report_says_with_what_each_session_was_made_and_what_each_column_of_the_table_holds(tmp_path):
    """With a plain CSV nothing said what its columns are; versions, floors and cards were in session files alone."""
    path, protocol = tmp_path / "P1.session", made_protocol("rating", {"blocks": 1, "rated": ["TD"]})
    with closing(SessionFile.create(path, protocol, "P1")) as file:
        file.set_up(set_up_of(HARDWARE) | {"system": "a computer", "python": "3.99"})
        file.add(file.study(protocol).answer({"rating": 40.0}, {"most_force_n": 700.0}))
        begun = file.about["begun"][:19].replace("T", " ")
    written_files([path], "report", tmp_path, Settings(bootstrap=0), protocol)
    written_files([path], "CSV", tmp_path / "trials.csv", Settings(), protocol)
    page = (tmp_path / "analysis.html").read_text()
    made = (
        "P1",
        begun,
        f"Underfoot {version('underfoot')}",
        "3.99",
        "a computer",
        "serial:ttyACM0",
        "1 x 1 tiles",
        "",
        "hw:1",
    )
    assert "".join(f"<td>{cell}</td>" for cell in made) in page
    header = (tmp_path / "trials.csv").read_text().splitlines()[0].split(",")
    assert [re.search(f"<td>{column}</td><td>[A-Z0-9][^<]{{9,}}</td>", page) for column in header].count(None) == 0
    assert "<td>most_force_n</td><td>Largest force on one tile during the presentation, in N.</td>" in page
