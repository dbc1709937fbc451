"""Arrays kept by the digest of their bytes: written once, never changed.

A file is a ``.npy`` record whose name is its SHA-256. Names are checked digests, so
that nothing a request says can point outside the folder.
"""

import hashlib
import io
import os
import re
from pathlib import Path

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from renderers.art.job_steps import Step, reached
from system import UserError, foreign_file, whole_file

_DIGEST = re.compile(r"[0-9a-f]{64}\Z")
LARGEST_HEADER = 4096


class DataStore:
    """Keep arrays in one folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._verified: set[str] = set()

    def put(self, array: NDArray[np.generic]) -> str:
        """Write an array unless it is there; return its digest."""
        if array.dtype.hasobject:
            raise UserError(f"an array of {array.dtype} cannot be stored")
        record = npy_record(array)
        digest = hashlib.sha256(record).hexdigest()
        path = self._folder / digest
        if not self.touch(digest):
            write_whole(path, record)
        reached(Step.DATA_STORED)
        return digest

    def touch(self, digest: str) -> bool:
        """Renew an array's time, so that pruning leaves it; False if it is gone."""
        try:
            os.utime(self._folder / digest)
        except FileNotFoundError:
            return False
        return True

    def get(
        self, digest: str, dtypes: tuple[str, ...], largest_bytes: int
    ) -> NDArray[np.generic]:
        """Map an array into memory, read-only.

        dtypes: names of those accepted. Raise UserError when there is no such array,
        its type or size is not what it should be, or its bytes are not those the
        digest promises.
        """
        if not _DIGEST.match(digest):
            raise UserError(f"{digest!r} is no digest")
        path = self._folder / digest
        try:
            size = path.stat().st_size
            with foreign_file(path, "an array"):
                array = npy.open_memmap(path, mode="r", max_header_size=LARGEST_HEADER)
        except FileNotFoundError as error:
            raise UserError(f"there is no data {digest}") from error
        if array.dtype.name not in dtypes or not array.flags.c_contiguous:
            raise UserError(
                f"data {digest} holds {array.dtype}, expected {' or '.join(dtypes)} in "
                "C order"
            )
        expected = array.offset + array.nbytes
        if size != expected or size > largest_bytes:
            raise UserError(
                f"data {digest} has {size} bytes; its header says {expected} and at "
                f"most {largest_bytes} are accepted"
            )
        if digest not in self._verified:
            with path.open("rb") as file:
                found = hashlib.file_digest(file, "sha256").hexdigest()
            if found != digest:
                raise UserError(f"data {digest} was changed; its digest is {found}")
            self._verified.add(digest)
        return array


def npy_record(array: NDArray[np.generic]) -> memoryview:
    """Encode an array as the bytes of a ``.npy`` file."""
    buffer = io.BytesIO()
    npy.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getbuffer()


HIDDEN = ".tmp-"
"""How the names of unfinished files begin."""


def write_whole(
    path: Path, record: bytes | memoryview, *, lasting: bool = True
) -> None:
    """Write a file beside its place and move it there: nobody ever sees half of it.

    lasting: the bytes have reached the disk before the name does, and the name on
    return, so that not even a crash of the machine loses the file. It takes the disk's
    time twice; do without for what is soon replaced, or see `make_last`. Raise OSError
    when the disk refuses.
    """
    # A job that was pruned meanwhile is not to be brought back.
    with whole_file(
        path, prefix=HIDDEN, ending="", mode=0o600, makes_folder=False
    ) as beside:
        beside.write_bytes(record)
        if lasting:
            make_last(beside)
        reached(Step.FILE_WRITTEN)
    if lasting:
        make_last(path.parent)


def make_last(*paths: Path) -> None:
    """Let files' bytes, or the names in folders, reach the disk."""
    for path in paths:
        if path.is_dir() and not hasattr(os, "O_DIRECTORY"):
            continue  # where folders are no files, the disk is left to keep names
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
