"""States of a session at some of its samples, from which any other is near.

Whoever steps the session keeps them: the flight, a player that goes to a moment, what
measures it. They are shared by all of these, and kept for the next one in a file of the
user's cache that can be thrown away. Its name tells the program that made it and what
was flown, so that no other program reads it and no other session is taken for this one.
"""

import threading
from bisect import bisect_right, insort
from collections.abc import Iterable
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from platformdirs import user_cache_path
from xxhash import xxh3_128

from paravol.patient import PatientScene
from paravol.versions import versions
from scenarios import Sample, Session
from scenarios.session import SessionState
from system.object_file import read_objects, save_objects

APART_S = 5.0
"""Seconds of flight between two keyframes: a jump steps no more than that."""

MOST_BYTES = 512 << 20
"""Of memory. Where more would be needed every other keyframe goes, and they are twice
as far apart from then on."""

MOST_FILE_BYTES = 1 << 30
"""Of all files together; the oldest go first."""

_STEPPED_BY = "anatomy", "paravol", "renderers", "scenarios", "surgery"
"""Packages that decide what a sample does."""

_HELD = "renderers", "scenarios", "surgery"
"""Packages whose objects are in a state."""

NOT_KEPT = OSError, TypeError, ValueError, OverflowError, RecursionError, MemoryError
"""What a disk raises, a damaged file, and a state that holds what no file keeps."""


@dataclass(frozen=True, slots=True)
class Keyframe:
    """The session after a sample; place: of that sample, -1 before the first."""

    place: int
    time_s: float
    sample: Sample | None
    state: SessionState


def _place(keyframe: Keyframe) -> int:
    return keyframe.place


class Keyframes:
    """Keep keyframes in order. All methods may be called by any thread."""

    def __init__(self, known: Iterable[Keyframe] = ()) -> None:
        self._lock = threading.Lock()
        self._kept = sorted(known, key=_place)
        self._thinned = 1
        self._bytes = 0
        self._seen: dict[int, object] = {}
        for keyframe in self._kept:
            self._bytes += _bytes_of(keyframe, self._seen)

    @property
    def kept(self) -> tuple[Keyframe, ...]:
        """Return all of them."""
        with self._lock:
            return tuple(self._kept)

    def before(self, place: int) -> Keyframe | None:
        """Return the last one at or before the sample of a place."""
        with self._lock:
            after = bisect_right(self._kept, place, key=_place)
            return self._kept[after - 1] if after else None

    @property
    def until_s(self) -> float:
        """Return the time up to which every moment has one near before it."""
        with self._lock:
            return self._kept[-1].time_s if self._kept else 0.0

    def follow(
        self, place: int, time_s: float, sample: Sample | None, session: Session
    ) -> None:
        """Keep one of now, where the one before is far; place: of the last sample."""
        last = self.before(place)
        if last is not None and time_s < last.time_s + self._thinned * APART_S:
            return
        keyframe = Keyframe(place, time_s, sample, session.checkpoint())
        with self._lock:
            insort(self._kept, keyframe, key=_place)
            self._bytes += _bytes_of(keyframe, self._seen)
            while self._bytes > MOST_BYTES and len(self._kept) > 2:
                self._kept = self._kept[::2]
                self._thinned *= 2
                self._seen = {}
                self._bytes = sum(_bytes_of(k, self._seen) for k in self._kept)


def _bytes_of(value: Any, seen: dict[int, object]) -> int:
    """Return the bytes of the arrays in an object, without those seen already."""
    if isinstance(value, str | int | float) or value is None or id(value) in seen:
        return 0
    seen[id(value)] = value
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, dict):
        return sum(_bytes_of(part, seen) for part in value.values())
    if isinstance(value, tuple | list):
        return sum(_bytes_of(part, seen) for part in value)
    if is_dataclass(value):
        parts = (getattr(value, f.name) for f in fields(value))
        return sum(_bytes_of(part, seen) for part in parts)
    return _bytes_of(vars(value), seen) if hasattr(value, "__dict__") else 0


def save_keyframes(folder: Path, patient: PatientScene, keyframes: Keyframes) -> None:
    """Keep a recorded session's keyframes; a disk that refuses keeps none.

    patient: that was flown through, before anybody operated. Raises nothing: without
    them a way through the recording is longer, and nothing else.
    """
    try:
        file = _file(folder, patient)
        save_objects(file, keyframes.kept)
        others = sorted(
            ((found.stat().st_mtime, found) for found in file.parent.iterdir()),
            reverse=True,
        )
        bytes_ = 0
        for _, found in others:
            bytes_ += found.stat().st_size
            if bytes_ > MOST_FILE_BYTES and found != file:
                found.unlink(missing_ok=True)
    except NOT_KEPT:
        return


def load_keyframes(folder: Path, patient: PatientScene) -> Keyframes:
    """Return what is kept of a recorded session; empty where nothing is."""
    try:
        file = _file(folder, patient)
        known = read_objects(file, ("paravol", *_HELD))
        return Keyframes(known if _are_keyframes(known) else ())
    except NOT_KEPT:
        return Keyframes()


def _are_keyframes(known: object) -> bool:
    return isinstance(known, tuple) and all(isinstance(k, Keyframe) for k in known)


def _file(folder: Path, patient: PatientScene) -> Path:
    digest = xxh3_128(_program())
    for name in ("session.json", "stream.mcap"):
        digest.update((folder / name).read_bytes())
    structures = patient.structures
    for part in (
        patient.surface_sha256,
        patient.hazards_sha256,
        "" if structures is None else structures.sha256(),
    ):
        digest.update(f"\0{part}".encode())
    cache_folder = user_cache_path("paravol", appauthor=False) / "keyframes"
    return cache_folder / f"{digest.hexdigest()}.keyframes"


@cache
def _program() -> bytes:
    """Return a digest of all that decides what a sample does."""
    root = Path(__file__).parents[2]
    digest = xxh3_128(repr(sorted(versions().items())).encode())
    for package in _STEPPED_BY:
        for file in sorted((root / package).rglob("*.py")):
            digest.update(f"\0{file.relative_to(root)}\0".encode())
            digest.update(file.read_bytes())
    return digest.digest()
