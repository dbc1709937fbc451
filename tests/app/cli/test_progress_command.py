"""`paravol progress` and `paravol annotate` on a recording that lies with the tests."""

import csv
import json
import shutil
from pathlib import Path

import pytest

from app.__main__ import main
from app.cli.train import keep_session
from paravol.progress.store import ProgressStore
from paravol.sessions.session_store import SessionStore
from tests.paravol.progress.learners import entry

SESSION = Path(__file__).parents[2] / "accuracy" / "before_the_move.paravol"


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("COLUMNS", "200")
    file = tmp_path / "p.sqlite"
    kept = ProgressStore(file)
    for n in range(1, 8):
        kept.add(entry("ann", n, path_mm=100 + 200 / n, has_passed=n > 2))
    kept.add(entry("bob", 9, path_mm=150.0))
    return file


def asked(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main(["progress", *map(str, words)]) == 0
    return capsys.readouterr().out


def test_a_recording_is_added_listed_and_deleted_with_its_bundle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bundle = tmp_path / "kept" / SESSION.name
    shutil.copytree(SESSION, bundle)
    file = tmp_path / "p.sqlite"
    words = ("add", bundle, "--motion-only", "--store", file)
    assert "Added" in asked(capsys, *words)
    assert "Replaced" in asked(capsys, *words, "--trainee", "Blauer Enzian")
    (told,) = json.loads(asked(capsys, "list", "--json", "--store", file))
    assert told["trainee"] == "Blauer Enzian"
    assert told["exercise"] == "first_flight"
    assert told["duration_s"] == pytest.approx(25.0, abs=0.1)
    names = {value["name"] for value in told["values"]}
    assert {"SPARC", "path length, raw", "contacts"} <= names
    # nothing of this machine or of who owns it
    assert str(tmp_path) not in json.dumps(told)
    delete = ("delete", SESSION.stem, "--recordings-in", bundle.parent)
    assert "would go" in asked(capsys, *delete, "--store", file)
    assert bundle.exists()
    asked(capsys, *delete, "--yes", "--store", file)
    assert not bundle.exists()
    assert json.loads(asked(capsys, "list", "--json", "--store", file)) == []


def test_a_curve_is_told_and_drawn(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("curve", "hoops", "--trainee", "ann", "--figure", "path length")
    for name in ("curve.svg", "curve.png"):
        out = tmp_path / name
        told = asked(capsys, *words, "--out", out, "--store", store)
        assert "power law, rate 1" in told
        assert "goes to" in told
        first = out.read_bytes()
        asked(capsys, *words, "--out", out, "--store", store)
        assert out.read_bytes() == first
    assert b"<svg" in (tmp_path / "curve.svg").read_bytes()
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
    report = json.loads(asked(capsys, *words, "--json", "--store", store))
    assert report["curve"]["plateau"] == pytest.approx(100.0, abs=1e-3)
    assert [rate["share"] for rate in report["pass_rate"]] == [0.6, 0.8, 1.0]
    told = asked(capsys, "curve", "hoops", "--trainee", "bob", "--store", store)
    assert "not enough data: 4 attempts are needed" in told


def test_tables_for_people_and_for_programs(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figure = ("--figure", "scope:path length", "--store", store)
    assert "7 attempts, 5 of 7 passed" in asked(capsys, *figure)
    assert "percentile" in asked(capsys, "cohort", *figure)
    table, xapi = tmp_path / "t.csv", tmp_path / "x.json"
    asked(capsys, "export", "--csv", table, "--xapi", xapi, "--store", store)
    with table.open(newline="") as file:
        assert {row["trainee"] for row in csv.DictReader(file)} == {"ann", "bob"}
    assert len(json.loads(xapi.read_text())) == 8
    asked(capsys, "delete", "--trainee", "ann", "--yes", "--store", store)
    assert ProgressStore(store).trainees() == ["bob"]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("curve", "none"), "no session of 'none'"),
        (("curve", "hoops", "--trainee", "ann", "--out", "a.pdf"), ".png or .svg"),
        (("cohort", "--figure", "speed"), "known are: SPARC; path length"),
        (("export",), "--csv FILE"),
        (("delete",), "Say which"),
        (("delete", "nobody"), "No session is called"),
        (("add",), "at least one session"),
        (("add", "none.paravol", "--trainee", "a@b.org"), "make up one"),
    ],
)
def test_mistakes_are_told_in_a_sentence(
    store: Path,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    problem: str,
) -> None:
    assert main(["progress", *words, "--store", str(store)]) != 0
    said = capsys.readouterr().err
    assert problem in " ".join(said.split())
    assert "Traceback" not in said


def test_a_flown_session_is_kept_and_nothing_fails_with_it(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    # of a case that is not there any more: kept without a score
    bundle = tmp_path / SESSION.name
    shutil.copytree(SESSION, bundle)
    info = json.loads((bundle / "session.json").read_text())
    scenario = json.loads(info["scenario"])
    scenario["head"]["case"] = str(tmp_path / "case")
    info["scenario"] = json.dumps(scenario)
    (bundle / "session.json").write_text(json.dumps(info))
    keep_session(bundle, "")
    keep_session(None, "")
    (kept,) = ProgressStore().sessions()
    assert (kept.trainee, kept.bundle) == ("", SESSION.name)
    assert "Not scored" in capsys.readouterr().out
    keep_session(tmp_path / "gone.paravol", "")
    assert "Not kept in paravol progress" in capsys.readouterr().err
    assert not SessionStore.of_the_user().folder.exists()


def test_notes_are_written_listed_and_removed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    bundle = tmp_path / SESSION.name
    shutil.copytree(SESSION, bundle)
    words = ["annotate", str(bundle)]
    assert main([*words, "Turn the horizon back", "--at", "12.5"]) == 0
    assert main(words) == 0
    assert "1: at 12.5 s" in capsys.readouterr().out
    assert main([*words, "x", "--at", "99"]) != 0
    assert "lasts from 0.0 to 25.0 s" in capsys.readouterr().err
    assert main([*words, "x"]) != 0
    assert main([*words, "--remove", "1"]) == 0
    assert "none" in capsys.readouterr().out
