"""What an object file gives back is what was put in, or nothing."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from system.object_file import read_objects, save_objects

HERE = __name__.partition(".")[0]


class Colour(Enum):
    """One of two."""

    RED = "red"
    BLUE = "blue"


class Pair(NamedTuple):
    """Two of anything."""

    first: Any
    second: Any


@dataclass(frozen=True, slots=True)
class Held:
    """Anything."""

    value: Any
    colour: Colour = Colour.RED


@dataclass
class Open:
    """Numbers."""

    numbers: list[float] = field(default_factory=list)


PLAIN = st.none() | st.booleans() | st.integers(-(1 << 63), (1 << 63) - 1) | st.text()
PARTS = PLAIN | st.floats(allow_nan=False) | st.sampled_from(Colour)
VALUES = st.recursive(
    PARTS,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.tuples(inner, inner)
        | st.builds(Pair, inner, inner)
        | st.builds(Held, inner, st.sampled_from(Colour))
        | st.builds(Open, st.lists(st.floats(allow_nan=False), max_size=3))
        | st.dictionaries(PLAIN, inner, max_size=3)
    ),
    max_leaves=12,
)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("objects") / "a.objects"


@given(value=VALUES)
def test_what_is_saved_comes_back(file: Path, value: object) -> None:
    save_objects(file, value)
    found = read_objects(file, [HERE])
    assert found == value
    assert repr(found) == repr(value)


@pytest.mark.parametrize("kind", ["<f8", "<f4", "|u1", "<i8", "|b1", "<c16", ">i2"])
def test_arrays_keep_bits_kind_and_whether_they_may_change(
    file: Path, kind: str
) -> None:
    one = np.arange(24).reshape(2, 3, 4).astype(kind)
    fixed = one.copy()
    fixed.flags.writeable = False
    save_objects(file, (one, fixed, one, one[1, 1, 1]))
    again, other, same, number = read_objects(file, [])
    assert again is same
    assert again.flags.writeable
    assert not other.flags.writeable
    for found in (again, other):
        assert found.dtype == one.dtype
        assert found.shape == one.shape
        assert found.tobytes() == one.tobytes()
    assert type(number) is type(one[1, 1, 1])
    assert number == one[1, 1, 1]


@pytest.mark.parametrize(
    "foreign",
    [np.array([None]), np.zeros(2, "f8,i4"), object(), iter(()), np.datetime64(1, "s")],
    ids=["objects", "records", "object", "iterator", "date"],
)
def test_what_is_foreign_is_refused(tmp_path: Path, foreign: object) -> None:
    with pytest.raises(TypeError, match="no file keeps"):
        save_objects(tmp_path / "a", [foreign])
    assert not list(tmp_path.iterdir())


def test_classes_of_others_are_not_made(file: Path) -> None:
    save_objects(file, Held(1))
    with pytest.raises(ValueError, match="is not expected"):
        read_objects(file, ["scenarios"])


@pytest.mark.parametrize(
    "damage", [lambda raw: raw[:-1], lambda raw: b"", lambda raw: raw[::-1]]
)
def test_what_is_cut_off_is_damaged(
    file: Path, damage: Callable[[bytes], bytes]
) -> None:
    save_objects(file, Held([1, np.zeros(100)]))
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(ValueError, match="is damaged"):
        read_objects(file, [HERE])


def test_a_changed_byte_anywhere_is_damage(file: Path) -> None:
    save_objects(file, Held([1, np.arange(100.0)]))
    raw = file.read_bytes()
    for place in range(len(raw)):
        changed = bytearray(raw)
        changed[place] ^= 0x11
        file.write_bytes(changed)
        # a bit of the header may say nothing about what is in it
        try:
            found = read_objects(file, [HERE])
        except ValueError:
            continue
        assert found.value[0] == 1
        assert np.array_equal(found.value[1], np.arange(100.0))
