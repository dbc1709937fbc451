"""Choices of the window's looks come back, whatever the file holds."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.trainee.window_preferences import (
    FONT_SCALES,
    WindowPreferences,
    preferences_file,
    read_preferences,
    write_preferences,
)
from system import UserError


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("settings") / "deep" / "window.json"


@given(st.text(), st.floats(*FONT_SCALES))
def test_what_is_chosen_comes_back(file: Path, theme: str, scale: float) -> None:
    chosen = WindowPreferences(theme, scale)
    write_preferences(chosen, file)
    assert read_preferences(file) == chosen


@given(st.binary())
def test_whatever_the_file_holds_a_window_opens(file: Path, held: bytes) -> None:
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(held)
    low, high = FONT_SCALES
    assert low <= read_preferences(file).font_scale <= high


def test_bounds_hold_and_what_another_version_wrote_is_left_out(file: Path) -> None:
    file.parent.mkdir(exist_ok=True)
    file.write_text('{"theme": "light", "font_scale": 99, "tour": true}')
    assert read_preferences(file) == WindowPreferences("light", FONT_SCALES[1])


def test_a_place_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        write_preferences(WindowPreferences(), tmp_path / "file" / "window.json")


def test_the_users_file_is_in_the_folder_of_settings() -> None:
    assert preferences_file().name == "window.json"
    assert read_preferences() == WindowPreferences()
