import io
import pickle
from pathlib import Path

import numpy as np
import pytest

from renderers.snapshots.data_store import DataStore


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
