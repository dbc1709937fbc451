"""Phantoms kept on disk, so that the same head is built once."""

import hashlib
import logging
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import platformdirs
from numpy.typing import NDArray

from anatomy.hazard_volumes import FARTHEST_MM, UNIT_MM, HazardVolumes
from anatomy.phantom.lattice import Box, Lattice
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, Progress, build_phantom, whole_field
from anatomy.queries.landmarks import landmarks
from anatomy.wall_layers import NO_WALL, WallKind, WallLayers
from renderers.scene import Volume
from renderers.scene.cache_entries import kept_entry, read_arrays
from system import UserError

log = logging.getLogger(__name__)

ENTRIES_KEPT = 8
"""Oldest entries beyond this many are removed: one at 0.5 mm takes 190 MB."""

# field of Phantom, dtype, background; the order is the order in the file
_VOLUMES = (
    ("ct", np.int16, -1000.0),
    ("labels", np.uint8, 0.0),
    ("sides", np.uint8, 0.0),
    ("bone_cover", np.uint8, 0.0),
    ("distance", np.float32, 6.0),
    ("blood", np.uint8, 0.0),
    ("skin", np.uint8, 0.0),
)
_HAZARD = "hazard "


def default_folder() -> Path:
    """Return the user's cache folder for phantoms."""
    return Path(platformdirs.user_cache_dir("paravol")) / "phantoms"


def code_version() -> str:
    """Hash the sources and the tables that decide what a phantom is."""
    digest = hashlib.sha256()
    sources = Path(__file__).parents[1]
    for path in sorted((*sources.rglob("*.py"), *sources.rglob("*.toml"))):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def entry_path(
    folder: Path, parameters: PhantomParameters, spacing_mm: float, field_mm: Box
) -> Path:
    """Return the file that holds one phantom of the present code."""
    key = msgspec.json.encode(
        [parameters.digest(), float(spacing_mm), field_mm, code_version()]
    )
    return folder / f"{hashlib.sha256(key).hexdigest()[:32]}.npz"


def sinus_phantom(
    parameters: PhantomParameters | None = None,
    spacing_mm: float = 0.5,
    progress: Progress | None = None,
    threads: int | None = None,
    field_mm: Box | None = None,
    folder: Path | None = None,
) -> Phantom:
    """Return a virtual patient, from the cache or newly built (and then kept).

    parameters: None is the default head. folder: None is `default_folder`. A broken
    entry is built again; a folder that cannot be written to costs time, not the
    result. Several processes may ask for the same phantom at once: each writes its
    own temporary file and the last to finish replaces the entry as a whole.
    """
    chosen = PhantomParameters() if parameters is None else parameters
    field_mm = field_mm or whole_field(chosen)
    lattice = Lattice.covering(spacing_mm, field_mm)
    path = entry_path(folder or default_folder(), chosen, spacing_mm, field_mm)
    found = _load(path, chosen, lattice)
    if found is not None:
        if progress is not None:
            progress("reading the phantom from the cache", 1.0)
        return found
    phantom = build_phantom(chosen, spacing_mm, progress, threads, field_mm)
    try:
        _store(path, phantom)
    except OSError as error:
        log.warning("the phantom could not be kept in %s: %s", path.parent, error)
    return phantom


def _load(
    path: Path, parameters: PhantomParameters, lattice: Lattice
) -> Phantom | None:
    """Read an entry; None if there is none or it is not what was stored."""

    def read(archive: Any) -> Phantom:
        volume = partial(_volume, archive, lattice)
        volumes = {name: volume(name, kind, out) for name, kind, out in _VOLUMES}
        kinds = msgspec.json.decode(
            archive["wall_kinds"].tobytes(), type=tuple[WallKind, ...]
        )
        layers = WallLayers(
            volume("wall", np.uint8, float(NO_WALL)),
            volume("ground", np.uint8, 0.0),
            kinds,
        )
        prefix, outside = _HAZARD, FARTHEST_MM / UNIT_MM
        hazards = HazardVolumes(
            {
                name.removeprefix(prefix): volume(name, np.int16, outside)
                for name in archive.files
                if name.startswith(prefix)
            }
        )
        return Phantom(
            parameters=parameters,
            landmarks=landmarks(parameters),
            layers=layers,
            hazards=hazards,
            **volumes,
        )

    return read_arrays(path, "a phantom", read)


def _volume(
    archive: Any, lattice: Lattice, name: str, dtype: type, background: float
) -> Volume:
    values: NDArray[Any] = archive[name]
    if values.dtype != dtype or values.shape != lattice.shape:
        raise UserError(f"{name} is {values.dtype} {values.shape}")
    spacing = np.full(3, lattice.spacing_mm)
    return Volume(values, spacing, lattice.origin_mm, background=background)


def _store(path: Path, phantom: Phantom) -> None:
    arrays = {name: getattr(phantom, name).values for name, _, _ in _VOLUMES}
    arrays |= {
        _HAZARD + name: volume.values
        for name, volume in phantom.hazards.volumes.items()
    }
    arrays["wall"] = phantom.layers.wall.values
    arrays["ground"] = phantom.layers.ground.values
    kinds = msgspec.json.encode(phantom.layers.kinds)
    arrays["wall_kinds"] = np.frombuffer(kinds, np.uint8)
    with kept_entry(path, ENTRIES_KEPT) as beside:
        np.savez(beside, **arrays)
