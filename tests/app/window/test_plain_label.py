"""Every label of the window shows a file's text as it stands."""

import ast
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QWidget

import app.window
from app.window.plain_label import PlainLabel, plain_tip, warning_box

EVIL = '<b>bold</b> <img src="x"> &amp; [advanced] \x1b[2J \u202eexe'


def test_a_label_shows_markup_as_letters(application: QApplication) -> None:
    label = PlainLabel(EVIL)
    label.setText(EVIL)
    assert label.textFormat() is Qt.TextFormat.PlainText
    assert label.text().startswith('<b>bold</b> <img src="x"> &amp; [advanced]')
    assert not {"\x1b", "\u202e"} & {*label.text()}


def test_a_warning_and_a_tip_show_markup_as_letters(application: QApplication) -> None:
    parent = QWidget()
    box = warning_box(EVIL, EVIL, parent)
    assert box.textFormat() is Qt.TextFormat.PlainText
    assert "<b>" in box.text()
    assert "&lt;b&gt;" in plain_tip(EVIL)
    assert plain_tip("2 of 3 done") == "2 of 3 done"


def test_no_page_has_labels_of_another_kind() -> None:
    """Qt's own label takes what looks like markup for markup."""
    folder = Path(app.window.__file__).parent
    for file in sorted(folder.rglob("*.py")):
        if file.name == "plain_label.py":
            continue
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in ("QLabel", "QMessageBox"), f"{file}:{node.lineno}"
                assert not called.startswith("QMessageBox."), f"{file}:{node.lineno}"
