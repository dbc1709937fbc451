"""One high-quality picture, and what was asked for beside it."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec

from paravol.snapshots.comparison import ComparisonReport, judge, splatted
from paravol.snapshots.film import LEAST_S
from paravol.snapshots.head_scene import RenderSettings
from paravol.snapshots.outputs import RenderedPicture, save_picture
from paravol.snapshots.path_state import key_of, load_state, save_state
from paravol.snapshots.render_session import RenderSession
from paravol.snapshots.view_file import ViewFile, both_eyes, exposed
from paravol.snapshots.wall_confidence import WallConfidence, save_wall_confidence
from renderers.snapshots.client import Snapshot
from renderers.snapshots.request import SnapshotResult


@dataclass(frozen=True, slots=True)
class Extras:
    """Name what is wanted beside a picture.

    state: file that paths of light continue from. stereo_mm: distance of two eyes.
    against: compare with the live picture (fsr) or the quick bounce light (fast).
    confidence: file of the map of hidden walls.
    """

    state: Path | None = None
    stereo_mm: float | None = None
    against: Literal["fsr", "fast"] | None = None
    confidence: Path | None = None


class StillReport(msgspec.Struct, frozen=True, omit_defaults=True):
    """Report a picture; None where something was not asked for."""

    file: str
    files: list[str]
    complete: bool
    result: SnapshotResult
    state: str | None = None
    against: ComparisonReport | None = None
    confidence: WallConfidence | None = None


def draw_still(
    session: RenderSession,
    view: ViewFile,
    settings: RenderSettings,
    files: tuple[Path, ...],
    extras: Extras,
    threads: int,
) -> StillReport:
    """Draw one picture and all that is wanted beside it; write the files."""
    key = key_of(session.head, view, settings)
    spec = settings.path_tracing
    if extras.state is not None and spec is not None:
        state = load_state(extras.state, key)
        if state is not None:
            spec = msgspec.structs.replace(spec, state=session.client.put(state))
            settings = replace(settings, path_tracing=spec)
    if extras.stereo_mm is None:
        picture, job = session.draw(view, settings, "Rendering the snapshot")
    else:
        picture, job = _pair(session, view, settings, extras.stereo_mm)
    for file in files:
        save_picture(file, picture)
    kept = extras.state
    if kept is not None and (job.folder / "paths.npy").exists():
        save_state(kept, job.state(), key)
    else:
        kept = None
    against = confidence = None
    if extras.against is not None and not session.interrupted:
        error = files[0].with_name(f"{files[0].stem}-error.png")
        if extras.against == "fsr":
            against = _against_live(session, picture, error, threads, settings)
        else:
            against = _against_quick_light(session, picture, error, settings)
    if extras.confidence is not None:
        confidence = save_wall_confidence(
            session.head, picture, extras.confidence, threads
        )
    return StillReport(
        str(files[0]),
        [str(file) for file in files],
        picture.result.complete,
        picture.result,
        None if kept is None else str(kept),
        against,
        confidence,
    )


def _pair(
    session: RenderSession, view: ViewFile, settings: RenderSettings, apart_mm: float
) -> tuple[RenderedPicture, Snapshot]:
    """Draw two eyes; they share the time, and what stops one stops both."""
    if settings.seconds is not None:
        settings = replace(settings, seconds=settings.seconds / 2)
    eyes = both_eyes(view, apart_mm)
    left, job = session.draw(eyes[0], settings, "Rendering the left eye")
    if session.interrupted:
        settings = replace(settings, seconds=LEAST_S)
    # one camera, one exposure
    other = exposed(eyes[1], left.result.gain)
    right, _ = session.draw(other, settings, "Rendering the right eye")
    return left.beside(right, apart_mm), job


def _against_live(
    session: RenderSession,
    picture: RenderedPicture,
    file: Path,
    threads: int,
    settings: RenderSettings,
) -> ComparisonReport:
    gain = picture.result.gain
    live = splatted(session.head, picture.view, gain, threads, settings.samples)
    return judge(live, picture, file, ("live (FSR)", "snapshot (ART)"))


def _against_quick_light(
    session: RenderSession,
    picture: RenderedPicture,
    file: Path,
    settings: RenderSettings,
) -> ComparisonReport:
    quick = replace(settings, path_tracing=None, seconds=None)
    view = exposed(picture.view, picture.result.gain)
    other, _ = session.draw(view, quick, "Rendering with the quick bounce light")
    names = ("quick bounce light", "light by paths")
    return judge(other.pixels, picture, file, names, other.rgba)
