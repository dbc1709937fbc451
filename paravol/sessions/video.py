"""A film of frames, as MP4."""

import os
from collections.abc import Generator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from system import UserError


class VideoWriter:
    """Write ``(h, w, 3)`` uint8 frames at a steady rate; a context manager.

    The file appears under its name only when it is complete. Width and height must
    be even (the colour planes have half the resolution).
    """

    def __init__(self, path: Path, size: tuple[int, int], fps: float) -> None:
        """Start the encoder; `size` is ``(width, height)``."""
        if size[0] % 2 or size[1] % 2:
            raise UserError(f"a video needs even width and height, got {size}")
        if path.suffix.lower() != ".mp4" or path.is_dir():
            raise UserError(f"a film goes to an .mp4 file, got {path}")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        self._partial = path.with_name(f".{path.stem}.{os.getpid()}.partial.mp4")
        self._size = size
        self._fps = fps
        self._frames = 0
        self._writer: Generator[None, Any, None] | None = None

    def add(self, pixels: NDArray[np.uint8]) -> None:
        """Append one frame; one of another size is scaled to the film's."""
        if self._writer is None:
            # Imported here: finding the encoder costs time that other commands need
            # not pay.
            from imageio_ffmpeg import write_frames

            self._writer = write_frames(
                str(self._partial),
                self._size,
                fps=self._fps,
                codec="libx264",
                quality=None,
                macro_block_size=1,
                # Mucosa is full of soft gradients; at 20 they show no bands.
                output_params=["-crf", "20", "-preset", "veryfast"],
            )
            self._writer.send(None)
        width, height = self._size
        if pixels.shape[:2] != (height, width):
            scaled = Image.fromarray(pixels).resize(
                self._size, Image.Resampling.LANCZOS
            )
            pixels = np.asarray(scaled)
        self._writer.send(np.ascontiguousarray(pixels))
        self._frames += 1

    @property
    def duration_s(self) -> float:
        """Return the length of the film so far."""
        return self._frames / self._fps

    def show_until(self, pixels: NDArray[np.uint8], time_s: float) -> None:
        """Show a frame up to `time_s` of the film, as often as the rate needs.

        Frames that come irregularly thus keep their times, to within one period.
        """
        while self.duration_s <= time_s:
            self.add(pixels)

    def __enter__(self) -> Self:
        try:
            self._partial.touch()  # the encoder reports a refusal late, in many lines
        except OSError as error:
            error.filename = str(self._path)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._writer is not None:
            self._writer.close()
        if kind is None and self._frames:
            os.replace(self._partial, self._path)
        else:
            self._partial.unlink(missing_ok=True)
