"""What a worker saves of a picture while it draws it, for whoever takes the job over.

Saved are the numbers of finished rays, and what light by random paths goes on from, so
that the picture has the bits that it has when nobody dies. Each file carries a digest
and a key: the request, the sources, the libraries and the processor. What another key
or digest stands before is not read, and is drawn anew.
"""

import hashlib
import platform
import time
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.job_steps import Step, reached
from renderers.art.regions import (
    REGION_PX,
    Gather,
    Region,
    finished_squares,
    region_payload,
    split_regions,
)
from renderers.snapshots.data_store import write_whole
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.spool import SAVE_EVERY_S, Spool
from renderers.snapshots.team import traced_camera

SHARE = 0.05
"""Of the time, that may go into saving."""

ENDING = ".saved"

_MAGIC = b"paravol saved 1\n"
_DIGEST = hashlib.sha256().digest_size


@cache
def code_key() -> bytes:
    """Return a digest of all that a ray's bits may depend on, besides the request.

    Ask once before anything is drawn: of sources that are replaced while they run it
    would tell those that do not run.
    """
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root)}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    for name in ("numpy", "numba", "scipy"):
        digest.update(f"{name} {version(name)}\0".encode())
    digest.update(_processor().encode())
    return digest.digest()


def _processor() -> str:
    """Return what numpy may choose its instructions by."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.machine() + platform.processor()
    features = (line for line in lines if line.lower().startswith(("flags", "feature")))
    return platform.machine() + next(features, "")


class SavedWork:
    """Save one attempt at a job; read what earlier ones saved."""

    def __init__(
        self,
        spool: Spool,
        request: SnapshotRequest,
        attempt: int,
        every_s: float = SAVE_EVERY_S,
    ) -> None:
        """Look at nothing yet.

        every_s: time between two savings, at least; 0 for whenever something is new.
        """
        self._before = [spool.attempt_folder(request.id, n) for n in range(1, attempt)]
        self._folder = spool.attempt_folder(request.id, attempt)
        self._every_s = every_s
        self._due = time.monotonic() + every_s
        record = msgspec.json.encode(request)
        self._key = hashlib.sha256(code_key() + record).digest()
        camera = traced_camera(request)
        self._size = camera.height, camera.width
        self._saved = finished_squares(np.zeros(self._size, np.bool_), REGION_PX)
        self._files = 0

    def restore(self, gather: Gather) -> int:
        """Add the rays of earlier attempts to an empty gather; count them."""
        empty = gather.missing
        for folder in self._before:
            for path in sorted(folder.glob(f"rays-*{ENDING}")):
                body = self._read(path)
                for payload in split_regions(body or b""):
                    gather.add_payload(payload)
        self._saved |= finished_squares(gather.done, REGION_PX)
        return empty - gather.missing

    def look(self, gather: Gather) -> None:
        """Save what is gathered when it is time."""
        self._when_due(lambda: self.save_rays(gather))

    def save_rays(self, gather: Gather) -> None:
        """Save the squares of the picture that are finished and were not saved yet."""
        fresh = finished_squares(gather.done, REGION_PX) & ~self._saved
        if not fresh.any():
            return
        height, width = self._size
        parts = []
        for row, column in np.argwhere(fresh).tolist():
            top, left = row * REGION_PX, column * REGION_PX
            right, bottom = left + REGION_PX, top + REGION_PX
            region = Region(left, top, min(right, width), min(bottom, height))
            here = region.rows, region.columns
            parts.append(region_payload(region, gather.value[here], gather.depth[here]))
        self._write(f"rays-{self._files:06}{ENDING}", b"".join(parts))
        self._files += 1
        self._saved |= fresh

    def paths(self) -> NDArray[np.float64] | None:
        """Read what the last attempt that saved any left of light by paths."""
        for folder in reversed(self._before):
            body = self._read(folder / f"paths{ENDING}")
            if body is not None and len(body) == 56 * self._size[0] * self._size[1]:
                return np.frombuffer(body, "<f8").reshape(*self._size, 7)
        return None

    def watch_paths(self, state: Callable[[], NDArray[np.float64]]) -> None:
        """Save what light by paths goes on from, when it is time."""
        self._when_due(lambda: self.save_paths(state()))

    def save_paths(self, state: NDArray[np.float64]) -> None:
        """Save it in place of what this attempt saved before."""
        self._write(f"paths{ENDING}", np.ascontiguousarray(state, "<f8").tobytes())

    def _when_due(self, save: Callable[[], None]) -> None:
        began = time.monotonic()
        if began < self._due:
            return
        try:
            save()
        except OSError:
            # The picture does not need it: draw on, and do not try again.
            self._due = float("inf")
            return
        now = time.monotonic()
        pause_s = max(self._every_s, (now - began) / SHARE) if self._every_s else 0.0
        self._due = now + pause_s

    def _write(self, name: str, body: bytes) -> None:
        record = wrap(self._key, body)
        # What a crash of the machine swallows or damages is drawn anew.
        write_whole(self._folder / name, record, lasting=False)
        reached(Step.WORK_SAVED)

    def _read(self, path: Path) -> bytes | None:
        """Read a file's body; None where there is none or it is not this picture's."""
        try:
            record = path.read_bytes()
        except OSError:
            return None
        read = unwrap(record)
        return read[1] if read is not None and read[0] == self._key else None


def wrap(key: bytes, body: bytes) -> bytes:
    """Write a record that tells whether it is whole; key: 32 bytes."""
    return b"".join((_MAGIC, key, hashlib.sha256(key + body).digest(), body))


def unwrap(record: bytes) -> tuple[bytes, bytes] | None:
    """Read the key and body of `wrap`; None when they are not what was written."""
    start = len(_MAGIC) + 2 * _DIGEST
    key, body = record[len(_MAGIC) : start - _DIGEST], record[start:]
    return (key, body) if record == wrap(key, body) else None


def forget_saved(spool: Spool, job_id: str) -> None:
    """Remove what was saved of a job, which has ended."""
    for path in spool.job_folder(job_id).glob(f"*/*{ENDING}"):
        path.unlink(missing_ok=True)
