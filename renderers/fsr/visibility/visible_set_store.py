"""Visible sets kept on disk, so that a patient's are found once."""

import hashlib
import logging
from pathlib import Path

import numpy as np
import platformdirs

from renderers.fsr.visibility.visible_sets import (
    BlockBounds,
    Progress,
    VisibleSets,
    build_visible_sets,
)
from renderers.scene import Volume
from renderers.scene.cache_entries import kept_entry, mark_used
from renderers.scene.thread_pool import ThreadPool
from system import ForeignFileError, foreign_file

log = logging.getLogger(__name__)

ENTRIES_KEPT = 16
"""Oldest entries beyond this many are removed: one at 0.5 mm takes 6 MB."""

_TYPES = {"shape": np.int64, "table": np.int32, "numbers": np.int32, "bits": np.uint8}


def default_folder() -> Path:
    """Return the user's cache folder for visible sets."""
    return Path(platformdirs.user_cache_dir("paravol")) / "visibility"


def entry_path(folder: Path, distance: Volume, bounds: BlockBounds) -> Path:
    """Return the file of one surface and its discs, as the present code finds it."""
    digest = hashlib.sha256()
    here = Path(__file__).parent
    kernels = here.parent / "kernels" / "visibility_floods.py"
    for source in (*sorted(here.glob("*.py")), kernels):
        digest.update(source.read_bytes() + b"\0")
    digest.update(repr((distance.shape, distance.values.dtype.str)).encode())
    for array in (
        distance.world_from_voxel,
        distance.values,
        bounds.numbers,
        bounds.places,
        bounds.cells,
    ):
        digest.update(np.ascontiguousarray(array).data)
    return folder / f"{digest.hexdigest()[:32]}.npz"


def stored_visible_sets(
    distance: Volume,
    bounds: BlockBounds,
    pool: ThreadPool,
    *,
    folder: Path | None = None,
    progress: Progress | None = None,
) -> VisibleSets:
    """Read a surface's visible sets, or find and keep them.

    folder: None is `default_folder`. A broken entry is made again; a folder that cannot
    be written to costs time, not the result.
    """
    path = entry_path(folder or default_folder(), distance, bounds)
    found = _load(path, bounds)
    if found is not None:
        return found
    sets = build_visible_sets(distance, bounds, pool, progress)
    try:
        _save(path, sets)
    except OSError as error:
        log.warning("visible sets could not be kept in %s: %s", path.parent, error)
    return sets


def _load(path: Path, bounds: BlockBounds) -> VisibleSets | None:
    """Read an entry; None if there is none or it is not what was stored."""
    if not path.is_file():
        return None
    try:
        with foreign_file(path, "visible sets"):
            with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in _TYPES}
            for name, dtype in _TYPES.items():
                if arrays[name].dtype != dtype:
                    raise ValueError(f"{name} is {arrays[name].dtype}")
            nz, ny, nx = (int(n) for n in arrays["shape"])
            table, numbers, bits = arrays["table"], arrays["numbers"], arrays["bits"]
            whole = bits.shape[1:] == (-(-len(numbers) // 8),)
            if table.shape != (nz * ny * nx,) or table.max(initial=-1) >= len(bits):
                raise ValueError(f"a table of {table.shape} for {nz, ny, nx} boxes")
            if not whole or not np.array_equal(numbers, bounds.numbers):
                raise ValueError(f"sets of {len(numbers)} other blocks")
        mark_used(path)
    except (ForeignFileError, OSError) as e:
        log.warning("the visible sets %s are broken and are made again: %s", path, e)
        return None
    return VisibleSets((nz, ny, nx), table, numbers, bits)


def _save(path: Path, sets: VisibleSets) -> None:
    with kept_entry(path, ENTRIES_KEPT) as beside:
        np.savez_compressed(
            beside,
            shape=np.array(sets.shape, np.int64),
            table=sets.table,
            numbers=sets.numbers,
            bits=sets.bits,
        )
