"""How tissue feels: every figure has a source, old cases open, the page is true."""

import re
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from anatomy.feel import (
    BARE_FRICTION,
    GUESS,
    feel_of,
    friction_of,
    ground_stiffness,
    with_feel,
)
from anatomy.tissue import TISSUE_OF, TISSUES, Label
from anatomy.wall_layers import NO_FEEL, WallFeel, WallKind

PAGE = Path(__file__).parents[2] / "docs" / "feel.md"

LAMINA = WallKind(
    "lamina papyracea", 0.5, 0.25, Label.MUCOSA, Label.LAMINA_PAPYRACEA, 9.195
)


def rows(title: str) -> dict[str, list[str]]:
    """Read a table of the page: cells by the first one."""
    part = PAGE.read_text("utf-8").split(f"## {title}\n")[1].split("\n## ")[0]
    lines = [
        re.split(r"\s*\|\s*", line)[1:-1]
        for line in part.splitlines()
        if line.startswith("| ")
    ]
    return {cells[0]: cells[1:] for cells in lines[1:]}


def test_the_page_lists_every_tissue_as_the_tables_have_it() -> None:
    found = rows("Tissues")
    assert set(found) == set(TISSUES) - {"air"}
    for name, (stiffness, friction, source) in found.items():
        assert float(stiffness) == TISSUES[name].stiffness_n_mm
        assert float(friction) == friction_of(name)
        assert source == GUESS


def test_the_page_lists_every_wall_that_breaks() -> None:
    found = rows("Walls that break")
    breaking = {name for name, tissue in TISSUES.items() if tissue.fracture_n > 0}
    assert set(found) == breaking
    for name, (stiffness, force, source) in found.items():
        assert float(stiffness) == TISSUES[name].stiffness_n_mm
        assert float(force) == pytest.approx(TISSUES[name].fracture_n, abs=0.11)
        assert source.startswith("literature: ")


@pytest.mark.parametrize("label", [label for label in Label if label >= Label.MUCOSA])
def test_every_wall_has_a_feel_and_every_figure_a_source(label: Label) -> None:
    fracture_n = TISSUE_OF[label].fracture_n
    for bone_mm in (0.0, 0.3):
        kind = WallKind("x", 0.5, bone_mm, Label.MUCOSA, int(label), fracture_n)
        feel = feel_of(kind)
        assert feel.soft_n_mm > 0
        assert 0 < feel.friction <= BARE_FRICTION
        assert feel.damping_ns_mm > 0
        assert feel.soft_source
        assert feel.friction_source
        assert bool(feel.hard_source) == (bone_mm > 0)
        assert bool(feel.break_source) == (bone_mm > 0 and fracture_n > 0)


def test_a_breaking_force_names_who_measured_it() -> None:
    assert "Am J Rhinol Allergy" in feel_of(LAMINA).break_source
    assert feel_of(LAMINA).hard_source == GUESS


def test_a_wall_that_says_how_it_feels_is_believed() -> None:
    told = WallFeel(0.2, 2.0, 0.3, 1e-4, "ours", "ours", "ours", "ours")
    kind = replace(LAMINA, feel=told)
    assert feel_of(kind) is told
    assert with_feel(kind) == kind
    assert with_feel(with_feel(LAMINA)) == with_feel(LAMINA) != LAMINA


def test_a_wall_of_an_old_case_opens_and_feels_like_a_new_one() -> None:
    """``case.json`` of before: no word about feel."""
    new = msgspec.to_builtins(with_feel(LAMINA))
    old = {name: value for name, value in new.items() if name != "feel"}
    read = msgspec.convert(old, WallKind)
    assert read.feel == NO_FEEL
    assert feel_of(read) == feel_of(msgspec.convert(new, WallKind))
    assert msgspec.json.decode(msgspec.json.encode(new), type=WallKind) == with_feel(
        LAMINA
    )


def test_every_ground_holds_a_tool() -> None:
    table = ground_stiffness()
    assert table.shape == (256,)
    assert np.all(table > 0)
    assert table[Label.FAT] < table[Label.MUSCLE] < table[Label.THICK_BONE]
