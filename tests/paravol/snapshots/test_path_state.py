"""Paths kept for another run are those of the same view, whole, or refused."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from paravol.snapshots.path_state import load_state, save_state


def test_a_state_comes_back_for_its_own_view_only(tmp_path: Path) -> None:
    file = tmp_path / "p.npz"
    assert load_state(file, "k") is None
    state = np.random.default_rng(0).normal(size=(4, 5, 7))
    save_state(file, state, "k")
    found = load_state(file, "k")
    assert found is not None
    assert_array_equal(found, state)
    with pytest.raises(ValueError, match="of another view, head or quality"):
        load_state(file, "other")
    assert [p.name for p in tmp_path.iterdir()] == ["p.npz"]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_half_a_file_is_refused(tmp_path: Path, share: float) -> None:
    file = tmp_path / "p.npz"
    save_state(file, np.ones((8, 8, 7)), "k")
    record = file.read_bytes()
    file.write_bytes(record[: int(share * len(record))])
    with pytest.raises(ValueError, match=r"p\.npz cannot be read .* remove the file"):
        load_state(file, "k")
