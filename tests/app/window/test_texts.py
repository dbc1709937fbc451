"""Every text of the window is in the catalogue, and German says all of it.

TEXTS_RENEW in the environment writes the template anew, and puts what it has into the
German file, to be translated there.
"""

import ast
import os
import re
import shutil
import string
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from anatomy.abstract import LABELS as SCENE_LABELS
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import plates
from anatomy.queries.landmarks import landmarks
from anatomy.scan.label_names import HAZARDS
from anatomy.tissue import TISSUES, Label
from app.window.keyboard.actions import GESTURES, Act, Group
from app.window.texts import FOLDER, later, read_po, take_language, tr
from app.window.themes import THEMES
from paravol.debrief.events import Kind as EventKind
from paravol.feedback import Strain
from paravol.sessions.time_marks import MarkKind
from paravol.trainee.exercises import learns, short_title
from scenarios import load_scenario
from scenarios.coverage.sites import SITE_NAMES
from scenarios.instruments import INSTRUMENTS
from scenarios.metrics import DEFINITIONS
from scenarios.rubrics import Standing, Verdict, load_rubric, shipped_rubrics
from scenarios.rubrics.rubric import FIGURES
from scenarios.scenario import Level, bundled_scenarios
from scenarios.structures import MUCOSA, NAMES
from scenarios.tasks import Status
from scenarios.tasks.head_parts import BULLA, CELLS, RETROBULLAR

WINDOW = FOLDER.parent
SHOWS = {
    *("QLabel", "QPushButton", "QCheckBox", "setText", "setToolTip", "setWindowTitle"),
    *("setAccessibleName", "setAccessibleDescription", "addTab", "addRow", "addAction"),
    *("notify", "_notify", "say", "ask", "show_stage", "setPlaceholderText"),
}
"""What shows the texts that it is called with."""


BELOW = (
    *("anatomy/phantom/phantom.py", "devices/controls/gamepad.py"),
    *("paravol/debrief/advice.py", "paravol/debrief/events.py"),
    *("paravol/feedback/taken_text.py", "paravol/feedback/touch_signs.py"),
    *("paravol/flight/flight.py", "paravol/flight/flight_events.py"),
    "paravol/flight/renderer_compiler.py",
    *("paravol/guide/goals.py", "paravol/guide/guide.py"),
    *("paravol/inputs/arm.py", "paravol/inputs/haptic.py"),
    *("paravol/inputs/instrument_input.py", "paravol/inputs/second_device.py"),
    *("paravol/inputs/pose_completer.py", "paravol/inputs/reach.py"),
    *(
        "paravol/scoring/metric_texts.py",
        "paravol/scoring/readings.py",
        "paravol/scoring/score_table.py",
    ),
    *("paravol/registration/arm_registration.py", "paravol/registration/at_start.py"),
    *("paravol/registration/record_rows.py", "paravol/registration/walk.py"),
    *("paravol/sessions/replay_worker.py", "paravol/sessions/time_marks.py"),
    *("paravol/scoring/session_metrics.py", "paravol/sessions/session_replay.py"),
    *(
        "paravol/trainee",
        "paravol/sessions/unfinished_sessions.py",
        "paravol/scoring/verdict_texts.py",
    ),
    *("paravol/flight/picture_size.py", "paravol/view.py"),
    "paravol/flight/operation_rehearsal.py",
    *("paravol/volume/presets.py", "paravol/volume/scan.py"),
    *("scenarios/metrics", "scenarios/passing.py"),
    *("scenarios/rubrics/assess.py", "scenarios/rubrics/assessment.py"),
    *("scenarios/rubrics/exercise_mark.py", "scenarios/rubrics/population.py"),
    *("scenarios/structures.py", "scenarios/tasks/rules.py"),
)
"""Modules and folders below the window that make texts which it shows."""

SINGLE = {
    *("{0}.", "{0} ({1})", "{0} · {1}"),
    *("Head: {0}", "Head: reading the case", "Scene: {0}"),
    *("broken", "budget", "closed", "failed", "far", "free", "hazards", "injected"),
    *("open", "points", "tip", "unknown", "working", "tool", "scope", "tissue"),
    *("contacts", "contact", "landmarks", "sign", "blood", "injuries", "recording"),
    *("bone", "soft tissue", "right", "left", "count", "assumed", "time", "arm"),
    *("Task", "Snapshot", "Injury", "Break", "Device", "Moment", "figure: {0}", "any"),
    *("homed this session", "in all", "patient", "nominal", "task: {0}"),
    *("above", "below"),
    "The flight stood still for {0:.1f} s; what was steered meanwhile is left out.",
    *("air to bone", "{0} {1:.0f}/{2:.0f}"),
}
"""What is made there in single words, or by modules that make little else to read."""

UNREAD = {
    *("none, emulated or force-dimension", "OpenIGTLink {0}:{1}", "asked for"),
    *("the record itself", "settings of metrics", "counts of the arm {0}", "Hausdorff"),
    *("stepped: {0}", "paravol replay {0}", "earlier choices", "picture size"),
    *("{0} and {1}", "{0} distance to expert"),
}
"""Texts of those modules that nobody reads."""

_PLACE = re.compile(r"\{\d+(:[^}]*)?\}")
_UNITS = {"mm", "mm2", "mm3", "mL", "ms", "fps"}


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
    found |= {text for act in Act for text in (act.does, act.row.text)}
    found |= {group.value for group in Group} | {name.capitalize() for name in THEMES}
    found |= {t for rows in GESTURES.values() for row in rows for t in row}
    found |= {name.capitalize() for name in INSTRUMENTS}
    found |= {text for level in Level for text in (str(level), str(level).capitalize())}
    for name in bundled_scenarios():
        scenario, _ = load_scenario(name)
        found |= {scenario.title, short_title(scenario), scenario.about}
        found |= {name.replace("-", " "), *(f.name for f in scenario.fiducials)}
        found |= {*scenario.hints, *learns(scenario)}
        for task in scenario.tasks:
            found |= {task.title, task.hint, task.name}
    return (found | made_below()) - {""}


def template(node: ast.JoinedStr) -> str:
    """Return an f-string with its places numbered; words that touch are one place."""
    told, places = "", 0
    for part in node.values:
        if isinstance(part, ast.FormattedValue):
            form = part.format_spec
            spec = f":{template(form)}" if isinstance(form, ast.JoinedStr) else ""
            quote = "'" if part.conversion == ord("r") else ""
            place = f"{quote}{{{places}{spec}}}{quote}"
            if not (place == f"{{{places}}}" and told.endswith(f"{{{places - 1}}}")):
                told += place
                places += 1
        elif isinstance(part, ast.Constant):
            told += str(part.value)
    return told


def made_in(node: ast.AST) -> Iterator[str]:
    """Return texts of a module, but for errors, documentation and comparisons."""
    match node:
        case ast.JoinedStr(values=values):
            yield template(node)
            for part in values:
                if isinstance(part, ast.FormattedValue):
                    yield from made_in(part.value)
        case ast.Constant(value=str(text)):
            yield text
        case ast.FunctionDef(body=body):
            for line in body:
                yield from made_in(line)
        case (
            ast.Raise()
            | ast.Compare()
            | ast.Subscript()
            | ast.Expr(value=ast.Constant())
            | ast.Assign(targets=[ast.Name(id="__all__")])
        ):
            return
        case _:
            for child in ast.iter_child_nodes(node):
                yield from made_in(child)


def is_read(text: str) -> bool:
    """Return whether a text of a module below looks like one for people."""
    rest = _PLACE.sub("", text)
    words = set(re.findall(r"[^\W\d_]{2,}", rest)) - _UNITS
    if re.search(r"[*|\[_]|\}/|/\{|-\{", text) or text.endswith(" ") or text in UNREAD:
        return False
    if rest != text:
        return " " in text and (bool(words) or ("{0}" in text and rest != " "))
    is_name = re.fullmatch("[A-Z][a-z]{2,}", text) is not None
    return bool(words) and (is_name or " " in text[1:])


def made_below() -> set[str]:
    """Return what the modules below make, and the names that they take from tables."""
    found = {
        text.removeprefix("  ")
        for name in BELOW
        for path in sorted((FOLDER.parents[2] / name).rglob("*.py")) or [Path(name)]
        for text in made_in(ast.parse(path.read_text(encoding="utf-8")))
        if is_read(text.removeprefix("  "))
    }
    for kinds in (EventKind, MarkKind, Standing, Status, Strain, Verdict):
        found |= {str(kind.value) for kind in kinds}
    found |= {*NAMES.values(), *HAZARDS, *INSTRUMENTS, *SITE_NAMES, MUCOSA}
    found |= {*FIGURES, *TISSUES, *SCENE_LABELS.values()}
    found |= {plate.name for plate in plates(PhantomParameters())}
    labels = {label.name.lower().replace("_", " ") for label in Label}
    found |= {BULLA, CELLS, RETROBULLAR}
    found |= {name for name in labels if not name.endswith("air")}
    found |= {name.partition(",")[0] for name in landmarks(PhantomParameters())}
    found |= {definition.name for definition in DEFINITIONS}
    for file in shipped_rubrics():
        rubric = load_rubric(file)
        parts = (*rubric.items, *rubric.fails)
        found |= {rubric.title, *(part.title for part in parts)}
    return found | SINGLE


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


def filled(text: str, word: str) -> str:
    """Return a text with a number or a word in each place."""
    apart = text.replace("}{", "}, {")
    return _PLACE.sub(lambda place: "3.5" if place[1] else word, apart)


@pytest.fixture
def in_german() -> Iterator[None]:
    take_language("de")
    yield
    take_language("en")


def test_what_is_made_below_is_said_with_its_values(
    german: dict[str, str], in_german: None
) -> None:
    made = {text: said for text, said in german.items() if _PLACE.search(text)}
    for text, said in made.items():
        assert tr(filled(text, "septum")) == filled(said, "Nasenscheidewand")
    taken = tr("Taken: uncinate 12 mm³, skin 3 mm³")
    assert taken == "Entfernt: Processus uncinatus 12 mm³, Haut 3 mm³"
    file = "a file, of /some/where: septum.nrrd"
    assert tr(file) == file


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
