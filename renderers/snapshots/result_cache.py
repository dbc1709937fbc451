"""Views that were drawn before: what has not changed is not drawn again.

A view is known by everything its request says but who asks, when, and how long it may
take; volumes and meshes are named there by the digest of what they hold, so that an
edit makes another view. A view of which only light, exposure or tools changed keeps
what its rays found; in mode classic rays end at tools, and only the background may
change.
"""

import hashlib
from collections import OrderedDict
from dataclasses import fields
from typing import Generic, TypeVar

import msgspec
import numpy as np

from renderers.scene import GBuffer, Image
from renderers.snapshots.delivery import Picture
from renderers.snapshots.request import ClassicWork, SnapshotRequest
from renderers.snapshots.team import Traced

V = TypeVar("V")

CACHE_BYTES = 256 << 20
"""Of pictures, and again of what rays found; the least recently used go."""


def picture_key(request: SnapshotRequest) -> bytes:
    """Describe all that a finished picture depends on."""
    anybody = msgspec.structs.replace(
        request,
        id="",
        priority=5,
        client="",
        max_seconds=1.0,
        deadline_s=None,
        progressive=False,
        deliver_after_s=None,
    )
    return msgspec.json.encode(anybody)


def trace_key(request: SnapshotRequest) -> bytes:
    """Describe all that rays depend on: not exposure, background or scope's tools."""
    work = request.work
    if isinstance(work, ClassicWork):
        bare: object = msgspec.structs.replace(work, background=(0.0, 0.0, 0.0))
    else:
        bare = work.distance, work.changes, work.grid
    # the key of the rest has the work of nobody in its place
    rest = msgspec.json.decode(picture_key(request)) | {"work": None}
    return msgspec.json.encode((bare, rest))


class ResultCache:
    """Keep finished pictures and traced rays, as many as there is room for.

    room: bytes of each; none are kept where it is 0.
    """

    def __init__(self, room: int = CACHE_BYTES) -> None:
        self._pictures = _Recent[Picture](room)
        self._traces = _Recent[Traced](room)

    def picture(self, request: SnapshotRequest) -> Picture | None:
        """Return the picture of an equal request, if it is still here."""
        return self._pictures.get(picture_key(request))

    def traced(self, request: SnapshotRequest) -> Traced | None:
        """Return what the rays of an equal view found, if it is still here."""
        return self._traces.get(trace_key(request))

    def keep_traced(self, request: SnapshotRequest, traced: Traced) -> None:
        """Keep what rays found, unless some were left out."""
        if traced.drawn is None:
            self._traces.put(trace_key(request), traced, traced.found)

    def keep_picture(self, request: SnapshotRequest, picture: Picture) -> None:
        """Keep a picture, unless it was stopped early."""
        if picture.complete:
            self._pictures.put(picture_key(request), picture, picture)


class _Recent(Generic[V]):
    """Map keys to values; the least recently used make room.

    Keys are digested: one with a camera and a transfer function is 2,000 bytes long.
    """

    def __init__(self, room: int) -> None:
        self._room = room
        self._values: OrderedDict[bytes, tuple[V, int]] = OrderedDict()

    def get(self, key: bytes) -> V | None:
        name = hashlib.sha256(key).digest()
        if name not in self._values:
            return None
        self._values.move_to_end(name)
        return self._values[name][0]

    def put(self, key: bytes, value: V, arrays: Picture | GBuffer | Image) -> None:
        held = (getattr(arrays, field.name) for field in fields(arrays))
        size = sum(array.nbytes for array in held if isinstance(array, np.ndarray))
        name = hashlib.sha256(key).digest()
        self._values.pop(name, None)
        if size <= self._room:
            self._values[name] = value, size
            while sum(size for _, size in self._values.values()) > self._room:
                self._values.popitem(last=False)
