"""`paravol coverage` refuses what it cannot write, before anything is loaded."""

from pathlib import Path

import pytest

from app.cli.coverage_command import CoverageOptions, coverage
from system import UserError

SESSION = Path(__file__).parents[2] / "accuracy" / "before_the_move.paravol"


def test_files_of_another_kind_are_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"must end in \.vtp"):
        coverage(SESSION, options=CoverageOptions(out=tmp_path / "seen.stl"))
    with pytest.raises(UserError, match=r"must end in \.png"):
        coverage(SESSION, options=CoverageOptions(picture=tmp_path / "seen.jpg"))
    with pytest.raises(UserError, match="nowhere"):
        coverage(
            tmp_path / "nowhere.paravol",
            options=CoverageOptions(picture=tmp_path / "seen.png"),
        )
