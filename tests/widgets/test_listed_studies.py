"""Studies in the list of the Experiment workspace without a participant: opened, simulated and analysed."""

import json

import pytest
from made_studies import TD, first_answers, protocol_text
from on_screen import show
from PySide6.QtCore import QObject, QPoint, Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QLabel, QMenu
from windows import dialog_of

from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog
from underfoot.widgets.experiment.people_dialog import PeopleDialog

pytest.importorskip("statsmodels")


def test_a_study_is_simulated_and_what_came_of_it_is_drawn(bench):
    workspace = bench.workspace
    listed = workspace.study_list.list
    titles = [listed.item(i).text() for i in range(listed.count())]
    assert titles == sorted(titles)
    row = [study.name for study in workspace.study_list.studies].index("detection-threshold")
    workspace.study_list.list.setCurrentRow(row)
    assert workspace.overview.about.text().endswith("in dB re 0.43\xa0m/s².")
    facts = workspace.overview.facts.text().split("  ·  ")
    assert facts[:3] == ["consent", "questions about the participant", "instruction"]
    assert facts[-1] == "orders by seed 65"
    bench.click(workspace.findings.simulate_button)
    bench.wait(lambda: workspace.findings.simulate_button.text() == "Stop")
    below = {label.text() for label in workspace.findings.drawings.findChildren(QLabel)}
    assert below == {"What is simulated or analysed is shown here."}  # it said that nothing was simulated
    bench.click(workspace.findings.simulate_button)
    assert workspace.overview.state.text() == "Stopped."
    bench.click(workspace.findings.simulate_button)
    bench.wait(lambda: "threshold TD" in workspace.findings.table.toPlainText())
    assert len(workspace.findings.drawings.plots) == 2
    workspace.findings.background.join()


def test_who_is_simulated_is_chosen_and_said(bench):
    workspace, findings = bench.workspace, bench.workspace.findings
    workspace.study_list.list.setCurrentRow([study.name for study in workspace.study_list.studies].index("free-labels"))
    bench.click(findings.people_button)
    dialog = dialog_of(bench.window, PeopleDialog)
    for name, text in {"people": "6", "impact_share_it": "9"}.items():
        dialog.rows.controls[name].selectAll()
        bench.qtbot.keyClicks(dialog.rows.controls[name], text)
    bench.click(dialog.use_button)
    assert dialog.note.text() == "impact_share_it is 9.0; allowed: 0 to 1"
    dialog.rows.controls["impact_share_it"].selectAll()
    bench.qtbot.keyClicks(dialog.rows.controls["impact_share_it"], "0.9")
    bench.click(dialog.use_button)
    assert findings.simulate_button.text() == "Simulate 6 people, with your settings"
    bench.click(findings.simulate_button)
    bench.wait(lambda: "6 simulated participants" in findings.table.toPlainText())
    assert "People differ: labels_differ." in findings.table.toPlainText()
    assert [line.split()[1] for line in findings.table.toPlainText().splitlines() if "impact_share_it" in line] == [
        "0.9"
    ]
    workspace.findings.background.join()


def test_other_files_are_analysed_and_trials_are_written(bench):
    """A CSV of trials in; a BIDS data set of the sessions out."""
    workspace, findings = bench.workspace, bench.workspace.findings
    path, session = bench.folder / "made.json", workspace.sessions.root / "made" / "P1.session"
    method = {"kind": "constant-stimuli", "parameters": {"blocks": 2}}
    stages = [{"id": "main", "kind": "trials", "method": method}]
    path.write_text(protocol_text(stages=stages, stimuli={"TD": TD, "X": TD}, title="Mine"))
    session.parent.mkdir(parents=True)
    file = SessionFile.create(session, Protocol.load(path), "P1")
    study = file.study(Protocol.load(path))
    while not study.is_done:
        file.add(study.answer(first_answers(study.page)))
    file.close()
    workspace.study_list.open_protocol(path)
    assert findings.analyse_button.text() == "Analyse 1 session"
    (bench.folder / "t.csv").write_text(
        "participant,method,trial,stimulus,db,felt\nQ7,constant-stimuli,1,X,0,no\nQ7,constant-stimuli,2,TD,6,yes\n"
    )
    bench.choose_from(findings.results_button, "Lapses: give psychometric curves a lapse rate")
    bench.choose_from(findings.results_button, "Analyse files…")
    asked = dialog_of(bench.window, QFileDialog)
    asked.filesSelected.emit([str(bench.folder / "t.csv")])
    asked.close()
    bench.wait(lambda: "Constant stimuli: main" in findings.table.toPlainText())
    assert "Each curve has a lapse rate." in findings.table.toPlainText()
    assert "Analysed as trials of the study Mine" in findings.table.toPlainText()
    again = type(findings)(workspace.study_list.study, workspace.sessions, QObject())
    again.attach(bench.window.settings)  # as at the next start
    assert again.results_button.lapses.isChecked()
    for form, choice, place in (
        ("Estimates", "Write each person's estimates as CSV…", "people.csv"),
        ("BIDS", "Write BIDS…", "bids"),
    ):
        bench.choose_from(findings.results_button, choice)
        asked = dialog_of(bench.window, QFileDialog)
        asked.fileSelected.emit(str(bench.folder / place))
        asked.close()
        told = f"{form} of 4 trials, participants: 1."
        bench.wait(lambda told=told: told in findings.table.toPlainText())
    assert (bench.folder / "people.csv").read_text().startswith("participant,main.")
    assert (bench.folder / "bids" / "sub-P1" / "beh").is_dir()
    workspace.findings.background.join()


def test_a_protocol_with_a_mistake_is_said_in_one_line(bench):
    said = []
    bench.workspace.notified.connect(said.append)
    path = bench.folder / "bad.json"
    path.write_text(json.dumps({"format": "underfoot-protocol", "version": 1, "stimuli": {"TD": TD}}))
    before = len(bench.workspace.study_list.studies)
    bench.workspace.study_list.open_protocol(path)
    assert len(bench.workspace.study_list.studies) == before
    assert said == [f"{path}: $.stages is []; allowed: at least one"]
    shown = dialog_of(bench.window, FileErrorDialog)
    assert "at least one" in shown.error_text.text()
    shown.close()


def test_a_protocol_that_is_opened_again_is_read_again_in_its_place(bench):
    workspace, path = bench.workspace, bench.folder / "again.json"
    path.write_text(protocol_text(title="First"))
    workspace.study_list.open_protocol(path)
    listed = [study.name for study in workspace.study_list.studies]
    assert listed.count("again") == 1
    workspace.study_list.list.setCurrentRow(0)
    path.write_text(protocol_text(title="Second"))
    workspace.study_list.open_protocol(bench.folder / "." / "again.json")
    assert [study.name for study in workspace.study_list.studies] == listed
    assert workspace.study_list.list.count() == len(listed)
    assert workspace.study_list.study.protocol.title == "Second"


def test_a_study_of_the_program_is_copied_and_not_deleted(bench):
    studies, said = bench.workspace.study_list, []
    studies.notified.connect(said.append)
    listed = studies.list
    listed.setCurrentRow(0)
    show(bench.qtbot, bench.window)  # closed dialogs leave none active
    listed.setFocus()
    QTest.keyClick(listed, Qt.Key.Key_Delete)
    assert said[-1].startswith("Only your own studies are deleted here")
    below = listed.visualItemRect(listed.item(listed.count() - 1)).bottomLeft() + QPoint(9, 9)
    QApplication.sendEvent(listed.viewport(), QContextMenuEvent(QContextMenuEvent.Reason.Mouse, below, below))
    assert listed.findChild(QMenu) is None  # below the last one is none that could be meant
    place = listed.visualItemRect(listed.item(0)).center()
    QApplication.sendEvent(listed.viewport(), QContextMenuEvent(QContextMenuEvent.Reason.Mouse, place, place))
    assert [one.isEnabled() for one in listed.findChild(QMenu).actions()] == [False, True, False]  # only a copy
    listed.findChild(QMenu).close()
