"""Names for compiled code on disk that no two processes give at the same time.

numba numbers the files of a function's specializations. Two processes that compile
different ones at the same time can give both the same number, and whoever reads then
gets machine code for other types: wrong pictures, or a crash (numba's issue 4807).
"""

from typing import Any
from uuid import uuid4

from numba.core import caching


def name_files_uniquely() -> None:
    """Let numba name each file of compiled code by a random number of 128 bits.

    numba calls this before it reads or writes the first one; see `numba_extensions` in
    pyproject.toml. What can still be lost is a line of an index that two processes
    write at once: then the function is compiled again.
    """
    file_class: Any = caching.IndexDataCacheFile
    file_class._data_name = _random_name


def _random_name(file: caching.IndexDataCacheFile, number: int) -> str:
    return str(file._data_name_pattern).replace("{number:d}", uuid4().hex)
