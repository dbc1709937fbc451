"""Pictures in a row: a film, or a folder of numbered stills."""

import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paravol.sessions.video import VideoWriter
from paravol.snapshots.head_scene import RenderSettings, placed
from paravol.snapshots.outputs import FILM, save_picture
from paravol.snapshots.render_session import RenderSession
from paravol.snapshots.view_file import ViewFile, exposed
from renderers.scene import GBuffer
from renderers.shading import AutoGain, meter
from system import UserError

LEAST_S = 0.05
"""A frame gets so much time even where none is left."""


@dataclass(frozen=True, slots=True)
class FilmReport:
    """Report a film. complete: False if a picture had to stop early."""

    file: str
    files: list[str]
    frames: int
    seconds: float
    complete: bool


def _materials(
    view: ViewFile, depth_mm: NDArray[np.float32]
) -> NDArray[np.uint8] | None:
    """Return what a picture shows, as the meter asks; None for no tools."""
    if not view.instruments:
        return None
    buffer = GBuffer.empty(*depth_mm.shape)
    # a tool is as far as the picture shows it, but for how its pixels were averaged
    buffer.depth_mm[:] = depth_mm * np.float32(1.001)
    for mesh, pose in placed(view.instruments):
        mesh.draw(buffer, view.to_camera(), pose)
    return buffer.material


def draw_film(
    session: RenderSession,
    views: list[ViewFile],
    settings: RenderSettings,
    files: tuple[Path, ...],
    fps: float,
) -> FilmReport:
    """Draw views in their order.

    Views without a gain of their own are exposed as the live camera does: the first as
    it meters, then the gain follows what was seen (`AutoGain`), so that light does not
    flicker and a near wall does not stay white. Each picture may take its share of the
    time that is left. Stills are written one by one; a film appears when it is
    complete, and not at all after Ctrl-C. Raise UserError for a folder that already
    holds pictures of a row, and for odd sizes of a film.
    """
    folders = [file for file in files if not file.suffix]
    for folder in folders:
        if folder.is_dir() and any(folder.glob("frame-*.png")):
            raise UserError(
                f"{folder} already holds pictures of a row; remove them or choose "
                "another folder with --out."
            )
    odd = [side for side in views[0].size_px if side % 2]
    if odd and len(folders) < len(files):
        raise UserError(
            f"a film needs even sizes, got {views[0].size_px}; say --size {odd[0] + 1}"
        )
    began = time.monotonic()
    complete, gain = True, AutoGain()
    with ExitStack() as stack:
        films = [
            stack.enter_context(VideoWriter(file, views[0].size_px, fps))
            for file in files
            if file.suffix.lower() == FILM
        ]
        for number, view in enumerate(views):
            share = settings
            if settings.seconds is not None:
                left = began + settings.seconds - time.monotonic()
                seconds = max(left / (len(views) - number), LEAST_S)
                share = replace(settings, seconds=seconds)
            if getattr(view.look, "gain", None) is None:
                view = exposed(view, gain.gain)
            picture, _ = session.draw(view, share, "Rendering a picture")
            session.progress("Pictures in a row", (number + 1) / len(views))
            if picture.result.gain is not None:
                gain.gain = picture.result.gain
                width = view.size_px[0]
                light = np.ascontiguousarray(picture.rgba[:, :width, :3])
                shown = _materials(view, picture.depth_mm[:, :width])
                gain.follow(meter(light, shown), 1 / fps)
            complete = complete and picture.result.complete
            for folder in folders:
                save_picture(folder / f"frame-{number + 1:05d}.png", picture)
            if session.interrupted:
                if films:
                    session.say("No film: it was interrupted.")
                # leaves no half a film
                raise KeyboardInterrupt
            for film in films:
                film.add(picture.pixels)
    names = [str(file) for file in files]
    return FilmReport(names[0], names, len(views), time.monotonic() - began, complete)
