import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from devices.recording.path_file import load_probe_path, save_probe_path
from devices.recording.probe_path import ProbePath


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    tip=arrays.arrays(
        np.float64, (101, 3), elements=st.floats(-1e300, 1e300, allow_subnormal=True)
    ),
    buttons=arrays.arrays(np.int64, 101, elements=st.integers(0, 127)),
)
def test_reading_gives_back_the_same_bits(
    tmp_path: Path, short_path: ProbePath, tip: np.ndarray, buttons: np.ndarray
) -> None:
    path = replace(short_path, tip_mm=tip, buttons=buttons, source='a "quoted" one')
    file = tmp_path / "a b.path.json"
    save_probe_path(path, file)
    back = load_probe_path(file)
    for field in fields(ProbePath):
        ours, theirs = getattr(path, field.name), getattr(back, field.name)
        assert np.array_equal(ours, theirs), field.name
    assert np.array_equal(np.signbit(path.tip_mm), np.signbit(back.tip_mm))
    assert [p.name for p in tmp_path.iterdir()] == [file.name]


def test_one_sample_takes_one_line_of_the_file(
    tmp_path: Path, short_path: ProbePath
) -> None:
    file = tmp_path / "p.path.json"
    save_probe_path(short_path, file)
    before = file.read_text().splitlines()
    tip = short_path.tip_mm.copy()
    tip[40] += 1.0
    save_probe_path(replace(short_path, tip_mm=tip), file)
    after = file.read_text().splitlines()
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1


def test_a_failed_write_leaves_the_old_file(
    tmp_path: Path, short_path: ProbePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "p.path.json"
    save_probe_path(short_path, file)
    before = file.read_bytes()

    def full(*names: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match="disk full"):
        save_probe_path(short_path, file)
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("format", "other", "format"),
        ("version", 2, "version"),
        ("frame", "RAS", "frame"),
        ("columns", ["t_s"], "columns must be"),
        ("rows", [[0.0]], "15 values"),
        ("rows", [], "at least 2 samples"),
        ("rows", None, "rows"),
        ("surplus", 1, "surplus"),
    ],
)
def test_wrong_files_are_refused_by_name(
    tmp_path: Path, short_path: ProbePath, key: str, value: object, message: str
) -> None:
    file = tmp_path / "p.path.json"
    save_probe_path(short_path, file)
    content = json.loads(file.read_text())
    content[key] = value
    file.write_text(json.dumps(content))
    with pytest.raises(ValueError, match=message) as caught:
        load_probe_path(file)
    assert str(file) in str(caught.value)


def test_fractional_buttons_are_refused(tmp_path: Path, short_path: ProbePath) -> None:
    file = tmp_path / "p.path.json"
    save_probe_path(short_path, file)
    content = json.loads(file.read_text())
    content["rows"][3][-1] = 0.5
    file.write_text(json.dumps(content))
    with pytest.raises(ValueError, match="whole numbers"):
        load_probe_path(file)


@given(cut=st.integers(0, 2000), junk=st.binary(max_size=6))
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_a_value_error_that_names_it(
    tmp_path: Path, short_path: ProbePath, cut: int, junk: bytes
) -> None:
    file = tmp_path / "p.path.json"
    save_probe_path(short_path, file)
    file.write_bytes(file.read_bytes()[:cut] + junk)
    with pytest.raises(ValueError, match=r"p\.path\.json.* a probe path: "):
        load_probe_path(file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"nowhere.* cannot be read: No such file"):
        load_probe_path(tmp_path / "nowhere.path.json")


def test_a_second_hand_and_scopes_come_back(
    tmp_path: Path, short_path: ProbePath
) -> None:
    turn = np.linspace(0.0, 720.0, 101)
    path = replace(
        short_path,
        instrument_roll_deg=turn,
        jaw=np.linspace(1.0, 0.0, 101),
        tools=((0.0, "injection needle"), (0.5, ""), (0.8, "straight forceps")),
        scopes=((0.2, 70.0), (0.9, None)),
    )
    save_probe_path(path, tmp_path / "p.path.json")
    back = load_probe_path(tmp_path / "p.path.json")
    for field in fields(ProbePath):
        ours, theirs = getattr(path, field.name), getattr(back, field.name)
        assert np.array_equal(ours, theirs), field.name
    held = [(back.sample(t).tool, back.sample(t).scope_deg) for t in (0.1, 0.6, 0.95)]
    assert held == [
        ("injection needle", None),
        ("", 70.0),
        ("straight forceps", None),
    ]
