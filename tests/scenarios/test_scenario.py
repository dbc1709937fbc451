from pathlib import Path

import pytest

from scenarios import load_scenario

GOOD = """
name = "own"
title = "One's own"
path = "own.path.json"
fiducials = [
  {name = "a", position_mm = [0, 0, 0]},
  {name = "b", position_mm = [9, 0, 0]},
  {name = "c", position_mm = [0, 9, 0]},
  {name = "d", position_mm = [0, 0, 9]},
]

[scope]
diameter_mm = 4.0
angle_deg = 30.0
ring_radius_mm = 1.45

[[moments]]
name = "first"
time_s = 2.5
"""


def test_a_file_of_ones_own_loads(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(GOOD)
    scenario, folder = load_scenario(str(tmp_path / "own.toml"))
    assert folder == tmp_path
    assert scenario.scope.endoscope().angle_deg == 30.0
    assert scenario.moments[0].time_s == 2.5
    assert scenario.head.seed == 1
    assert scenario.fiducial_positions()["b"].tolist() == [9, 0, 0]


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (('name = "own"', 'nmae = "own"'), "nmae"),
        (("angle_deg = 30.0", "angle_deg = 130.0"), "angle"),
        (("angle_deg = 30.0", 'angle_deg = "thirty"'), "angle_deg"),
        (('  {name = "d", position_mm = [0, 0, 9]},\n', ""), "at least 4"),
        (('"own.path.json"', '"../../etc/passwd"'), "beside it"),
        (("[scope]", "[scope"), "not valid"),
    ],
)
def test_mistakes_are_named(
    tmp_path: Path, change: tuple[str, str], complaint: str
) -> None:
    (tmp_path / "own.toml").write_text(GOOD.replace(*change))
    with pytest.raises(ValueError, match=complaint):
        load_scenario(str(tmp_path / "own.toml"))


def test_unknown_names_list_the_known_ones() -> None:
    with pytest.raises(ValueError, match="There is no scenario named 'nose-job'"):
        load_scenario("nose-job")


def test_a_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="cannot be read"):
        load_scenario(str(tmp_path / "none.toml"))
