from pathlib import Path

import pytest

from scenarios.metrics import Settings, load_settings
from system import UserError


def written(folder: Path, text: str) -> Path:
    file = folder / "settings.toml"
    file.write_text(text)
    return file


def test_a_file_changes_what_it_names(tmp_path: Path) -> None:
    text = "idle_mm_s = 3.0\n[margins_mm]\norbit = 2.0\n[wanted_mm3]\nuncinate = 50.0\n"
    found = load_settings(written(tmp_path, text))
    assert found.idle_mm_s == 3.0
    assert found.margin_of("orbit") == 2.0
    assert found.margin_of("skull base") == Settings().margin_mm
    assert found.cutoff_hz == Settings().cutoff_hz


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("idle_mm_s = -1.0", "idle_mm_s"),
        ("rate_hz = 0.0", "rate_hz"),
        ("cutoff_hz = 60.0", "cutoff_hz"),
        ("filter_order = 0", "filter_order"),
        ("rest_mm_s = 20.0", "rest_mm_s"),
        ("idel_s = 1.0", "idel_s"),
        ("margin_mm = nan", "margin_mm"),
        ("margins_mm = {orbit = 0.0}", "orbit"),
        ("idle_s = 'long'", "idle_s"),
        ("not toml", "toml"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(UserError, match=told):
        load_settings(written(tmp_path, text))


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        load_settings(tmp_path / "none.toml")
