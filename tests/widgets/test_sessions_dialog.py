"""The sessions of a study in a dialog, by real clicks and keys: one is left out of the analysis, and taken in again."""

from contextlib import closing

import pytest
from made_studies import first_answers, protocol_text
from PySide6.QtCore import Qt
from windows import dialog_of

from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.widgets.experiment.sessions_dialog import WHY_FIRST, SessionsDialog

pytest.importorskip("statsmodels")


def test_a_session_is_left_out_with_a_reason_and_taken_in_again(bench):
    """The window had no way to leave somebody out, and none to say why."""
    workspace, findings = bench.workspace, bench.workspace.findings
    path, folder = bench.folder / "made.json", workspace.sessions.root / "made"
    path.write_text(protocol_text())
    protocol = Protocol.load(path)
    folder.mkdir(parents=True)
    for person, answers in (("P1", 4), ("P2", 4), ("P3", 3)):
        with closing(SessionFile.create(folder / f"{person}.session", protocol, person)) as file:
            study = file.study(protocol)
            while len(study.entries) < answers:
                file.add(study.answer(first_answers(study.page)))
    (folder / "P4.session").write_bytes(b"no more")
    workspace.study_list.open_protocol(path)
    bench.choose_from(findings.results_button, "Sessions…")
    dialog = dialog_of(bench.window, SessionsDialog)
    bench.wait(lambda: dialog.lines)
    cells = [[dialog.table.item(row, column).text() for column in (0, 2, 3)] for row in range(4)]
    assert cells[:3] == [["P1", "4", "complete"], ["P2", "4", "complete"], ["P3", "3 of 4", "not finished"]]
    assert cells[3] == ["P4", "", "is not a session of a study: file is not a database"]
    dialog.table.setCurrentCell(3, 0)
    assert not dialog.leave_button.isEnabled()
    dialog.table.setCurrentCell(0, 0)
    bench.qtbot.keyClick(dialog.table, Qt.Key.Key_Down)
    bench.qtbot.keyClick(dialog.table, Qt.Key.Key_Return)
    assert dialog.note.text() == WHY_FIRST
    bench.qtbot.keyClicks(dialog.why, "loose shoe")
    bench.qtbot.keyClick(dialog.why, Qt.Key.Key_Return)
    bench.wait(lambda: dialog.table.item(1, 3).text() == "left out: loose shoe")
    assert dialog.table.item(1, 4).text() == "left out of the analysis: loose shoe"
    assert workspace.overview.state.text().startswith("P2: left out of the analysis: loose shoe.")
    bench.qtbot.keyClick(dialog.table, Qt.Key.Key_Return)  # once too often: it closes, and changes nothing
    (folder / "P4.session").unlink()
    bench.click(findings.analyse_button)
    bench.wait(lambda: "Left out by the experimenter: P2 (loose shoe)." in findings.table.toPlainText())
    findings.background.join()
    bench.choose_from(findings.results_button, "Sessions…")
    dialog = dialog_of(bench.window, SessionsDialog)
    bench.wait(lambda: dialog.lines)
    dialog.table.setCurrentCell(1, 0)
    assert (dialog.why.text(), dialog.why.isEnabled()) == ("loose shoe", False)
    bench.click(dialog.leave_button)
    bench.wait(lambda: [line.left_out for line in dialog.lines] == [""] * 3)
    dialog.id.setFocus()
    assert (dialog.id.text(), dialog.id_button.isEnabled()) == ("P2", False)
    bench.qtbot.keyClicks(dialog.id, "0")
    bench.qtbot.keyClick(dialog.id, Qt.Key.Key_Return)
    bench.wait(lambda: dialog.table.item(1, 0).text() == "P20 (P2.session)")
    assert dialog.table.item(1, 4).text().startswith("id corrected to P20; begun as P2; ")
    assert (dialog.lines[1].left_out, dialog.note.text()) == ("", "")  # Return was of the id alone
    with closing(SessionFile.open(folder / "P1.session")) as file:
        file.hold()  # as where it goes on in another window
        dialog.table.setCurrentCell(0, 0)
        bench.qtbot.keyClicks(dialog.why, "telephone")
        bench.click(dialog.leave_button)
        bench.wait(lambda: dialog.note.text().endswith("end it there first"))
    dialog.close()
