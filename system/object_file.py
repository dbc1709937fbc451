"""Objects of our own in a file of the user's cache: arrays, records, what holds them.

What is read makes records of classes that are loaded already, and runs nothing. An
object that is held twice is written once and comes back once. Only for files that this
program wrote for itself: whoever may forge one may forge any number in it.
"""

import sys
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from system.whole_file import whole_file

PLAIN = frozenset((type(None), bool, int, float, str))
_DAMAGES = LookupError, TypeError, AttributeError, OverflowError
HOLDERS = {"tuple": tuple, "list": list, "set": set, "frozenset": frozenset}


def save_objects(path: Path, value: object) -> None:
    """Write an object; OSError where the disk refuses, TypeError for what is foreign.

    Arrays, numpy's numbers, data classes, named tuples, enums, and objects whose state
    is their `__dict__` may be in it. RecursionError for circles, ValueError and
    OverflowError for what is too large.
    """
    from zstandard import ZstdCompressor

    table = _Table()
    raw = msgspec.msgpack.encode([table.put(value), table.rows])
    squeezed = ZstdCompressor(level=1, write_checksum=True).compress(raw)
    with whole_file(path, mode=0o600) as beside:
        beside.write_bytes(squeezed)


def read_objects(path: Path, packages: Iterable[str]) -> Any:
    """Read what was saved; ValueError where it is damaged or holds something else.

    packages: whose classes may be in it. OSError where there is no such file.
    """
    from zstandard import ZstdDecompressor, ZstdError

    squeezed = path.read_bytes()
    damages = (ZstdError, msgspec.DecodeError, *_DAMAGES)
    try:
        raw = ZstdDecompressor().decompress(squeezed)
        root, rows = msgspec.msgpack.decode(raw)
        allowed = frozenset(packages)
        found: list[Any] = []
        for row in rows:
            found.append(_made(row, found, allowed))
        return _held(root, found)
    except damages as error:
        raise ValueError(f"{path} is damaged: {error}") from error


class _Table:
    """Number objects, those that an object holds before it."""

    def __init__(self) -> None:
        self.rows: list[list[Any]] = []
        self._known: dict[int, tuple[int, object]] = {}

    def put(self, value: object) -> object:
        """Return a plain value itself, and of another the number, in a list."""
        if type(value) in PLAIN:
            return value
        known = self._known.get(id(value))
        if known is None:
            self.rows.append(self._row(value))
            # held, so that no other object gets its place in memory
            known = self._known[id(value)] = len(self.rows) - 1, value
        return [known[0]]

    def _row(self, value: Any) -> list[Any]:
        kind = type(value)
        if (
            isinstance(value, np.ndarray | np.generic)
            and value.dtype.kind not in "biufc"
        ):
            raise TypeError(f"no file keeps numbers of the kind {value.dtype}")
        if kind is np.ndarray:
            may_change = value.flags.writeable
            return ["array", value.dtype.str, value.shape, value.tobytes(), may_change]
        if isinstance(value, np.generic):
            return ["number", value.dtype.str, value.tobytes()]
        if kind.__name__ in HOLDERS and kind is HOLDERS[kind.__name__]:
            return [kind.__name__, *map(self.put, value)]
        if kind is dict:
            pairs = [self.put(part) for item in value.items() for part in item]
            return ["dict", *pairs]
        name = [kind.__module__, kind.__qualname__]
        if isinstance(value, Enum):
            return ["enum", *name, self.put(value.value)]
        if isinstance(value, tuple):
            return ["named", *name, *map(self.put, value)]
        if is_dataclass(kind):
            state = {f.name: getattr(value, f.name) for f in fields(kind)}
        elif isinstance(value, msgspec.Struct):
            state = {name: getattr(value, name) for name in kind.__struct_fields__}
        elif hasattr(value, "__dict__"):
            state = vars(value)
        else:
            raise TypeError(f"no file keeps a {kind.__module__}.{kind.__qualname__}")
        return ["object", *name, self.put(state)]


def _held(value: Any, found: list[Any]) -> Any:
    return found[value[0]] if isinstance(value, list) else value


def _made(row: list[Any], found: list[Any], allowed: frozenset[str]) -> Any:
    """Make the object of a row; found: those before it."""
    kind, *rest = row
    if kind == "array":
        made = np.frombuffer(rest[2], rest[0]).reshape(rest[1]).copy()
        # what is read only is another type to compiled code
        made.flags.writeable = rest[3]
        return made
    if kind == "number":
        return np.frombuffer(rest[1], rest[0])[0]
    if kind in HOLDERS:
        return HOLDERS[kind](_held(part, found) for part in rest)
    if kind == "dict":
        parts = [_held(part, found) for part in rest]
        return dict(zip(parts[::2], parts[1::2], strict=True))
    module, name, *rest = rest
    if module.partition(".")[0] not in allowed:
        raise TypeError(f"{module}.{name} is not expected")
    of: Any = sys.modules[module]
    for part in name.split("."):
        of = getattr(of, part, None)
    if not isinstance(of, type):
        raise TypeError(f"{module}.{name} is no class")
    if kind == "enum":
        return of(_held(rest[0], found))
    if kind == "named":
        return of(*(_held(part, found) for part in rest))
    state = _held(rest[0], found)
    if issubclass(of, msgspec.Struct):
        return of(**state)
    value = object.__new__(of)
    for key, part in state.items():
        object.__setattr__(value, key, part)
    return value
