"""Light by paths that goes on in another run: what has come together, in a file."""

import hashlib
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from paravol.snapshots.head_scene import HeadScene, RenderSettings
from paravol.snapshots.view_file import ViewFile
from system import ForeignFileError, UserError, foreign_file, whole_file


def key_of(head: HeadScene, view: ViewFile, settings: RenderSettings) -> str:
    """Hash what the paths of a view depend on."""
    what = (view, head.surface_sha256, settings.quality, settings.samples)
    return hashlib.sha256(msgspec.json.encode(what)).hexdigest()


def save_state(file: Path, state: NDArray[np.float64], key: str) -> None:
    """Write a state, atomically."""
    with whole_file(file) as beside, beside.open("wb") as sink:
        np.savez_compressed(sink, state=state, key=np.array(key))


def load_state(file: Path, key: str) -> NDArray[np.float64] | None:
    """Read a state; None where there is no file yet.

    UserError for a file that is none, or holds another view's paths.
    """
    if not file.exists():
        return None
    try:
        # opened here: numpy leaves a file that it cannot read open
        with (
            foreign_file(file, "paths of light"),
            file.open("rb") as source,
            np.load(source, allow_pickle=False) as parts,
        ):
            state, found = parts["state"], str(parts["key"])
    except (ForeignFileError, OSError) as error:
        raise UserError(f"{error} To begin anew, remove the file.") from error
    if found != key:
        raise UserError(
            f"The paths in {file} are of another view, head or quality; name another "
            "file, or remove it to begin anew."
        )
    return np.asarray(state)
