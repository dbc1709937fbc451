"""Pictures in a row: a film, or a folder of numbered stills."""

import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.cli.drawing import Drawing
from app.cli.terminal import Stages
from disk import UserError
from paravol.snapshots.outputs import FILM, save_drawn
from paravol.snapshots.stereo import exposed
from paravol.snapshots.studio import Fineness
from paravol.snapshots.view_file import ViewFile
from paravol.video import VideoWriter
from renderers.shading import AutoGain, meter

LEAST_S = 0.05
"""A frame gets so much time even where none is left."""


def draw_film(
    drawing: Drawing,
    views: list[ViewFile],
    fineness: Fineness,
    files: tuple[Path, ...],
    fps: float,
    stages: Stages,
) -> dict[str, Any]:
    """Draw views in their order; give what came out.

    Views without a gain of their own are exposed as the live camera does: the first as
    it meters, then the gain follows what was seen (`AutoGain`), so that light does not
    flicker and a near wall does not stay white. Each picture may take its share of the
    time that is left. Stills are written one by one; a film appears when it is
    complete, and not at all after Ctrl-C. Raise ValueError for a folder that already
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
    quiet = _Overall(stages, len(views))
    with ExitStack() as stack:
        films = [
            stack.enter_context(VideoWriter(file, views[0].size_px, fps))
            for file in files
            if file.suffix.lower() == FILM
        ]
        for number, view in enumerate(views):
            share = fineness
            if fineness.seconds is not None:
                left = began + fineness.seconds - time.monotonic()
                seconds = max(left / (len(views) - number), LEAST_S)
                share = replace(fineness, seconds=seconds)
            drawn, _ = drawing.draw(_with_gain(view, gain.gain), share, quiet.stage)
            quiet.done(number + 1)
            if drawn.result.gain is not None:
                gain.gain = drawn.result.gain
                gain.follow(meter(drawn.rgba[..., :3]), 1 / fps)
            complete = complete and drawn.result.complete
            for folder in folders:
                save_drawn(folder / f"frame-{number + 1:05d}.png", drawn)
            if drawing.interrupted:
                if films:
                    stages.say("No film: it was interrupted.")
                # leaves no half a film
                raise KeyboardInterrupt
            for film in films:
                film.add(drawn.pixels)
    return {
        "file": str(files[0]),
        "files": [str(file) for file in files],
        "frames": len(views),
        "seconds": time.monotonic() - began,
        "complete": complete,
    }


def _with_gain(view: ViewFile, gain: float | None) -> ViewFile:
    own = getattr(view.look, "gain", None)
    return view if own is not None else exposed(view, gain)


class _Overall:
    """Name the stage of the picture that is drawn."""

    def __init__(self, stages: Stages, pictures: int) -> None:
        self._stages = stages
        self._pictures = pictures
        self.stage = "Rendering a picture"

    def done(self, number: int) -> None:
        """Show how many pictures there are."""
        self._stages("Pictures in a row", number / self._pictures)
