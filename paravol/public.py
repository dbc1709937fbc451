"""What ``import paravol`` gives; see docs/python.md."""

from collections.abc import Iterator
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices import load_probe_path
from paravol.patient import (
    HighQualityPicture,
    Look,
    PatientScene,
    Progress,
    instrument,
    load_case,
    load_phantom,
    no_progress,
    thread_count,
)
from paravol.session_replay import (
    RecordedSession,
    Replay,
    ReplayedFrame,
    ReplayReport,
    read_session,
    replay_session,
)
from scenarios import load_scenario, tip_frame

__all__ = [
    "HighQualityPicture",
    "Look",
    "PatientScene",
    "RecordedSession",
    "ReplayReport",
    "ReplayedFrame",
    "flight_pose",
    "instrument",
    "load",
    "phantom",
    "read_session",
    "replay",
    "replay_frames",
]

StrPath = str | PathLike[str]


def phantom(
    seed: int = 1, spacing_mm: float = 0.5, progress: Progress | None = None
) -> PatientScene:
    """Return a virtual patient, from the user's cache or built in about a minute.

    seed: decides the anatomy; 1 is the patient of the bundled flight. spacing_mm: of
    the voxels. progress: called with what is being done and the share, 0 to 1.
    """
    return load_phantom(seed, spacing_mm, progress or no_progress)


def load(folder: StrPath, progress: Progress | None = None) -> PatientScene:
    """Read a case made by ``paravol import`` or ``paravol phantom``.

    UserError where the folder is no case, or has no surface to be seen.
    """
    return load_case(Path(folder), progress or no_progress)


def flight_pose(
    time_s: float, scenario: str = "first_flight"
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where a scenario's recorded path has the scope and the suction tube.

    time_s: seconds from the path's beginning, held within it. scenario: a bundled name
    or a ``.toml`` file. Return ``world_from_tip`` and ``world_from_instrument``, 4x4;
    they belong to the scenario's own patient, ``phantom(seed=1)`` for the bundled one.
    """
    described, folder = load_scenario(scenario)
    at = load_probe_path(folder / described.path).sample(time_s)
    instrument_pose = tip_frame(at.instrument_tip_mm, at.instrument_axis)
    return tip_frame(at.tip_mm, at.axis), instrument_pose


def replay(
    folder: StrPath,
    *,
    video: StrPath | None = None,
    patient: PatientScene | None = None,
    progress: Progress | None = None,
) -> ReplayReport:
    """Draw and score a recorded session again; report whether it came out the same.

    video: an ``.mp4`` file to write. patient: the one that was flown through, where it
    is loaded already. UserError for what is no session, or another head's.
    """
    return replay_session(
        Path(folder),
        threads=thread_count(),
        progress=progress or no_progress,
        video=None if video is None else Path(video),
        patient=patient,
    )


def replay_frames(
    folder: StrPath, patient: PatientScene | None = None
) -> Iterator[ReplayedFrame]:
    """Yield the frames of a recorded session as they are drawn again; as `replay`."""
    return Replay(Path(folder), thread_count(), no_progress, patient).frames()
