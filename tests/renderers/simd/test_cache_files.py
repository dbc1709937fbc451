"""Compiled code that two processes write at the same time is never mixed up."""

from pathlib import Path
from typing import Any

import pytest
from numba.core import caching, entrypoints

INDEX_FILE: Any = caching.IndexDataCacheFile
CALL_ENTRY_POINTS: Any = entrypoints.init_all


def test_two_who_write_at_once_mix_nothing_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is read for a key is what was written for it, or nothing."""
    CALL_ENTRY_POINTS()
    one, other = (INDEX_FILE(str(tmp_path), "f", 0) for _ in range(2))
    save_data = one._save_data

    def let_the_other_in(name: str, code: str) -> None:
        # It has looked into the index before the first one wrote there.
        with monkeypatch.context() as earlier:
            earlier.setattr(other, "_load_index", dict)
            other.save("floats", "code for floats")
        save_data(name, code)

    monkeypatch.setattr(one, "_save_data", let_the_other_in)
    one.save("ints", "code for ints")
    reader = INDEX_FILE(str(tmp_path), "f", 0)
    assert reader.load("ints") in (None, "code for ints")
    assert reader.load("floats") in (None, "code for floats")

    monkeypatch.setattr(one, "_save_data", save_data)
    one.save("ints", "code for ints")
    assert reader.load("ints") == "code for ints"
    assert reader.load("floats") == "code for floats"
