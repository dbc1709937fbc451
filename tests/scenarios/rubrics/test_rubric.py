"""Rubric files: what is shipped holds, and each fault is told with its line."""

from pathlib import Path

import pytest

from scenarios.rubrics import load_rubric, shipped_rubrics
from scenarios.rubrics.rubric import MOST_REMOVAL_PERCENT, Item
from system import UserError

GOOD = """\
name = "own"
version = 3
title = "Own"
total_points = 10
pass_percent = 50
[[items]]
name = "way"
title = "Way"
metric = "path length"
role = "scope"
points = 8
bands = [[100, 100], [300, 0]]
[[items]]
name = "taken"
title = "Taken"
metric = "tissue removed"
points = 2
bands = [[0, 0], [50, 100], [90, 0]]
[[fails]]
name = "hurt"
title = "Hurt"
metric = "breaches"
above = 0
most_percent = 20
"""


def written(folder: Path, text: str) -> Path:
    file = folder / "own.toml"
    file.write_text(text)
    return file


@pytest.mark.parametrize("name", shipped_rubrics())
def test_shipped_rubrics_hold(name: str) -> None:
    rubric = load_rubric(name)
    assert rubric.name == name
    assert sum(item.points for item in rubric.items) == rubric.total_points == 100.0
    removal = sum(item.points for item in rubric.items if item.is_removal)
    assert removal <= MOST_REMOVAL_PERCENT


def test_the_hash_follows_what_is_said_and_not_how(tmp_path: Path) -> None:
    first = load_rubric(written(tmp_path, GOOD)).sha256()
    spaced = GOOD.replace("version = 3", "version   =   3  # the third")
    assert load_rubric(written(tmp_path, spaced)).sha256() == first
    other = GOOD.replace("[300, 0]", "[301, 0]")
    assert load_rubric(written(tmp_path, other)).sha256() != first


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"path length"', '"path lenght"', "line 9, .*did you mean 'path length'"),
        ('role = "scope"', 'role = "scop"', "line 10, .*'scope'.* got 'scop'"),
        ('role = "scope"\n', "", "the role of 'path length' must be"),
        ("pass_percent", "pas_percent", "line 5, .*'pass_percent'"),
        ("total_points = 10", "total_points = 11", "line 4, .*have 10 points"),
        ("[300, 0]", "[90, 0]", "line 12, .*must ascend"),
        ("[[100, 100]", "[[100, 80]", "no value gives 100 %"),
        ("[[100, 100]", "[[nan, 100]", "must be finite"),
        ("[300, 0]", "[300, -1]", "must lie in 0 to 100"),
        ("points = 8", "points = -8", "points must be above 0"),
        (", [90, 0]]", "]", "ever more tissue"),
        ('"taken"', '"way"', "two items named 'way'"),
        ("above = 0\n", "", "either above or below"),
        ("most_percent = 20", "most_percent = 120", "most_percent must lie"),
        ("version = 3", "version = 0", "version must be at least 1"),
        ('metric = "breaches"', 'figure = "bled_m"', "did you mean 'bled_ml'"),
        ('metric = "breaches"', 'task = "a"\nfigure = "washes"', "one of metric"),
        ('metric = "breaches"', 'task = "a"\nof = "any"', "of goes with a metric"),
    ],
)
def test_faults_are_told_with_their_line(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert old in GOOD
    file = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(UserError, match=words):
        load_rubric(file)


def test_removal_must_not_dominate(tmp_path: Path) -> None:
    text = GOOD.replace("points = 8", "points = 6").replace("points = 2", "points = 4")
    with pytest.raises(UserError, match="at most 30 % may be"):
        load_rubric(written(tmp_path, text))


def test_unknown_names_and_files(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="did you mean 'endoscopy'"):
        load_rubric("endoskopy")
    with pytest.raises(UserError, match="cannot be read"):
        load_rubric(tmp_path / "none.toml")


def test_an_item_is_called_by_what_it_reads() -> None:
    item = Item(name="a", title="A", metric="breaches", of="orbit", points=1, bands=())
    assert item.full_name == "breaches: orbit"
