import io
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderers.snapshots.data_store import DataStore, write_whole


def test_arrays_come_back_read_only(tmp_path: Path) -> None:
    store = DataStore(tmp_path)
    array = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
    digest = store.put(array)
    assert [p.name for p in tmp_path.iterdir()] == [digest]
    found = store.get(digest, ("int16",), 1 << 20)
    assert np.array_equal(found, array)
    assert not found.flags.writeable
    assert store.put(array.copy()) == digest
    assert store.put(array + 1) != digest


def test_a_transposed_array_is_stored_in_c_order(tmp_path: Path) -> None:
    store = DataStore(tmp_path)
    array = np.arange(6, dtype=np.float32).reshape(2, 3).T
    assert np.array_equal(store.get(store.put(array), ("float32",), 1000), array)


def test_what_is_not_the_promised_array_is_refused(tmp_path: Path) -> None:
    store = DataStore(tmp_path)
    digest = store.put(np.zeros((3, 4), np.float32))
    with pytest.raises(ValueError, match="holds float32, expected int16"):
        store.get(digest, ("int16",), 1000)
    with pytest.raises(ValueError, match="at most 100 are accepted"):
        store.get(digest, ("float32",), 100)
    with pytest.raises(ValueError, match="there is no data"):
        store.get("0" * 64, ("float32",), 1000)
    with pytest.raises(ValueError, match="is no digest"):
        store.get("../" + digest, ("float32",), 1000)
    record = (tmp_path / digest).read_bytes()
    for wrong, said in ((record[:-4], "damaged"), (record + b"\0", "its header says")):
        (tmp_path / digest).write_bytes(wrong)
        with pytest.raises(ValueError, match=said):
            DataStore(tmp_path).get(digest, ("float32",), 1000)
    (tmp_path / digest).write_bytes(record[:-1] + b"\1")
    with pytest.raises(ValueError, match="was changed"):
        DataStore(tmp_path).get(digest, ("float32",), 1000)


class Trap:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return (pytest.fail, ("an object was unpickled",))


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    store = DataStore(tmp_path)
    objects = np.array([Trap()], dtype=object)
    with pytest.raises(ValueError, match="cannot be stored"):
        store.put(objects)
    buffer = io.BytesIO()
    np.save(buffer, objects, allow_pickle=True)
    for record in (buffer.getvalue(), pickle.dumps(Trap()), b""):
        (tmp_path / ("a" * 64)).write_bytes(record)
        with pytest.raises(ValueError, match=r"."):
            store.get("a" * 64, ("float32", "object"), 1000)


def test_arrays_of_one_shape_and_other_content_have_other_keys(tmp_path: Path) -> None:
    """Whoever calls them alike: one voxel is enough, and both can be had."""
    store = DataStore(tmp_path)
    first = np.zeros((4, 5, 6), np.int16)
    second = first.copy()
    second[3, 4, 5] = 1
    digests = [store.put(first), store.put(second), store.put(first.copy())]
    assert digests[0] == digests[2] != digests[1]
    for digest, array in zip(digests, (first, second), strict=False):
        assert np.array_equal(store.get(digest, ("int16",), 10_000), array)


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_whole(path, b"one")
    write_whole(path, memoryview(b"two, longer"))
    assert path.read_bytes() == b"two, longer"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_whole(path, b"one")
    text: Any = "text"
    with pytest.raises(TypeError):
        write_whole(path, text)
    assert path.read_bytes() == b"one"
    assert list(tmp_path.iterdir()) == [path]
