"""Every text of the window is in the catalogue, and German says all of it.

TEXTS_RENEW in the environment writes the template anew, and puts what it has into the
German file, to be translated there.
"""

import ast
import os
import shutil
import string
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from app.window.keyboard.actions import ACTIONS, GESTURES, Group
from app.window.texts import FOLDER, later, read_po, take_language, tr
from app.window.themes import THEMES
from paravol.trainee.exercises import learns, short_title
from scenarios import load_scenario
from scenarios.instruments import INSTRUMENTS
from scenarios.scenario import Level, bundled_scenarios

WINDOW = FOLDER.parent
SHOWS = {
    *("QLabel", "QPushButton", "QCheckBox", "setText", "setToolTip", "setWindowTitle"),
    *("setAccessibleName", "setAccessibleDescription", "addTab", "addRow", "addAction"),
    *("notify", "_notify", "say", "ask", "show_stage", "setPlaceholderText"),
}
"""What shows the texts that it is called with."""


def parsed() -> Iterator[tuple[Path, ast.Module]]:
    for path in sorted(WINDOW.rglob("*.py")):
        yield path, ast.parse(path.read_text(encoding="utf-8"))


def calls(tree: ast.AST) -> Iterator[tuple[str, ast.Call]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            function = node.func
            if isinstance(function, ast.Attribute):
                yield function.attr, node
            elif isinstance(function, ast.Name):
                yield function.id, node


def words_in(node: ast.AST) -> Iterator[str]:
    """Return texts with words, but for those that are asked of the catalogue."""
    if isinstance(node, ast.Call):
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        if sum(letter.isalpha() for letter in node.value) > 2:
            yield node.value
        return
    if isinstance(node, ast.Subscript | ast.Compare | ast.FormattedValue):
        return
    for child in ast.iter_child_nodes(node):
        yield from words_in(child)


def wanted() -> set[str]:
    """Return all that the window asks the catalogue for."""
    found = {
        constant.value
        for _, tree in parsed()
        for name, call in calls(tree)
        if name in (tr.__name__, later.__name__) and call.args
        for constant in ast.walk(call.args[0])
        if isinstance(constant, ast.Constant) and isinstance(constant.value, str)
    }
    found |= {text for action in ACTIONS for text in (action.does, action.row)}
    found |= {group.value for group in Group} | {name.capitalize() for name in THEMES}
    found |= {t for rows in GESTURES.values() for row in rows for t in row}
    found |= {name.capitalize() for name in INSTRUMENTS}
    found |= {text for level in Level for text in (str(level), str(level).capitalize())}
    for name in bundled_scenarios():
        scenario, _ = load_scenario(name)
        found |= {scenario.title, short_title(scenario), scenario.about}
        found |= {*scenario.hints, *learns(scenario)}
        found |= {text for task in scenario.tasks for text in (task.title, task.hint)}
    return found - {""}


def quoted(text: str) -> str:
    lines = text.splitlines(keepends=True) or [""]
    escaped = [
        line.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        for line in lines
    ]
    return "\n".join(f'"{line}"' for line in escaped)


def entries(said: dict[str, str]) -> str:
    return "".join(
        f"\nmsgid {quoted(text)}\nmsgstr {quoted(said[text])}\n"
        for text in sorted(said)
        if text
    )


def header(language: str) -> str:
    told = f"Language: {language}\nContent-Type: text/plain; charset=UTF-8\n"
    return f'msgid ""\nmsgstr ""\n{quoted(told)}\n'


def fields(text: str) -> list[tuple[str, str]]:
    """Return a text's placeholders, with how they are formatted."""
    parts = string.Formatter().parse(text)
    return sorted((name, spec or "") for _, name, spec, _ in parts if name)


@pytest.fixture(scope="module")
def german() -> dict[str, str]:
    file = FOLDER / "de.po"
    if os.environ.get("TEXTS_RENEW"):
        FOLDER.mkdir(exist_ok=True)
        texts = dict.fromkeys(wanted(), "")
        template = header("") + entries(texts)
        (FOLDER / "paravol.pot").write_text(template, encoding="utf-8")
        before = read_po(file.read_text(encoding="utf-8")) if file.is_file() else {}
        said = {text: before.get(text, "") for text in texts}
        file.write_text(header("de") + entries(said), encoding="utf-8")
    said = read_po(file.read_text(encoding="utf-8"))
    said.pop("")
    return said


def test_the_template_has_all_texts_of_the_window(german: dict[str, str]) -> None:
    template = read_po((FOLDER / "paravol.pot").read_text(encoding="utf-8"))
    assert set(template) - {""} == wanted()


def test_german_says_all_and_fills_the_same_places(german: dict[str, str]) -> None:
    assert {text for text in wanted() if not german.get(text)} == set()
    assert set(german) == wanted()
    for text, said in german.items():
        assert fields(text) == fields(said), text
        for ends in (" ", "\n", "  "):
            assert text.startswith(ends) == said.startswith(ends), text
            assert text.endswith(ends) == said.endswith(ends), text
        assert text.count("&") == said.count("&"), text


def test_the_file_is_one_of_gettexts(tmp_path: Path) -> None:
    program = shutil.which("msgfmt")
    if program is None:
        pytest.skip("there is no msgfmt")
    out = str(tmp_path / "de.mo")
    command = [program, "--check-format", "-o", out, str(FOLDER / "de.po")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_no_text_is_shown_past_the_catalogue() -> None:
    past = [
        f"{path.relative_to(WINDOW)}:{call.lineno} {words}"
        for path, tree in parsed()
        for name, call in calls(tree)
        if name in SHOWS
        for argument in call.args
        for words in words_in(argument)
    ]
    assert [line for line in past if "PARAVOL" not in line] == []


def test_texts_are_said_in_the_language_that_is_chosen() -> None:
    assert tr("Settings") == "Settings"
    take_language("de")
    assert tr("Settings") == "Einstellungen"
    assert tr("Volume {volume:.0%}", volume=0.5) == "Lautstärke 50%"
    assert tr("no such text") == "no such text"
    take_language("en")
    assert tr("Settings") == "Settings"
    take_language("xx")
    assert tr("Settings") == "Settings"
