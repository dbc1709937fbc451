"""Tables that the program reads for itself are checked as a user's files are."""

from pathlib import Path

import pytest

from anatomy.phantom.fixed_shapes import built
from anatomy.table_file import read_table
from system import ForeignFileError


def test_a_table_of_another_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("one = 1.5\ntwo = 2\n")
    module = str(tmp_path / "a.py")
    assert read_table(module, "a.toml", dict[str, float]) == {"one": 1.5, "two": 2.0}
    (tmp_path / "a.toml").write_text('one = 1.5\ntwo = "2"\n')
    with pytest.raises(ForeignFileError, match=r"a\.toml.*must be a number"):
        read_table(module, "a.toml", dict[str, float])


@pytest.mark.parametrize(
    "rows",
    [
        ((1.0, 2.0, 3.0, 4.0),),
        ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0, 7.0)),
        ((1.0, 2.0, 3.0),) * 3,
    ],
)
def test_rows_of_no_shape_are_refused(rows: tuple[tuple[float, ...], ...]) -> None:
    with pytest.raises(ValueError, match="neither a chain nor an ellipsoid"):
        built(rows)
