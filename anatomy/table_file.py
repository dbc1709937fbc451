"""Tables of the program's own: TOML files beside the modules that read them."""

from pathlib import Path
from typing import TypeVar

from system.typed_record import decode_toml

_T = TypeVar("_T")


def read_table(module: str, name: str, kind: type[_T]) -> _T:
    """Return the table beside a module, checked to be of a kind.

    module: the module's ``__file__``. Raise ForeignFileError naming the file and what
    in it is of another kind.
    """
    file = Path(module).with_name(name)
    return decode_toml(file.read_bytes(), kind, file, "a table")
