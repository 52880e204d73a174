"""A window where numbers are written with a comma: typed either way, kept and saved with a point."""

import json

import pytest
from PySide6.QtCore import QLocale, Qt
from PySide6.QtTest import QTest
from windows import quiet_window

TYPED = {
    "velocity": {"0.25": 0.25, "0,25": 0.25, "2,5e-1": 0.25, "250 mm/s": 0.25},
    "stiffness": {"1 000,5": 1000.5, "1.0005 kN/m^a": 1000.5, "1,0005k": 1000.5},
    "level": {"-6,5": 10 ** (-6.5 / 20), "-6.5 dB": 10 ** (-6.5 / 20)},
}


@pytest.fixture
def window(qtbot, tmp_path):
    before = QLocale()
    QLocale.setDefault(QLocale(QLocale.Language.German, QLocale.Country.Germany))
    yield quiet_window(qtbot, tmp_path / "kept")
    QLocale.setDefault(before)


def test_commas_and_points_are_typed_and_points_are_saved(window, tmp_path):
    assert QLocale().decimalPoint() == ","
    design = window.workspaces["Design"]
    window.actions_by_name["new"].trigger()
    design.canvas.add("impact")
    design.canvas.patch_scene.select(["impact"])
    for name, entries in TYPED.items():
        field = design.inspector.editors[name].field
        for text, value in entries.items():
            field.setFocus()
            field.selectAll()
            QTest.keyClicks(field, text)
            QTest.keyClick(field, Qt.Key.Key_Return)
            assert design.patch().node("impact").parameters[name] == pytest.approx(value, rel=1e-12), text
            assert "," not in field.text()
    window.open_patch.patch.save(tmp_path / "a.json")
    saved = json.loads((tmp_path / "a.json").read_text())["nodes"][0]["parameters"]
    assert saved["stiffness"] == 1000.5
    window.settings.level_db = -12.5
    window.settings.save(tmp_path)
    assert json.loads((tmp_path / "settings.json").read_text())["level_db"] == -12.5
