"""Files that a picture becomes, each by its ending, each whole or not at all."""

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from paravol.snapshots.picture_files import save_depth_nrrd, save_exr
from paravol.snapshots.view_file import ViewFile
from paravol.versions import versions
from renderers.scene import save_png
from renderers.snapshots.client import Snapshot
from renderers.snapshots.request import SnapshotResult
from system import UserError

STILLS = (".png", ".exr", ".nrrd")
FILM = ".mp4"


@dataclass(frozen=True, slots=True)
class RenderedPicture:
    """A picture taken from the ray tracer.

    pixels: ``(h, w, 3)`` uint8 sRGB. rgba: ``(h, w, 4)`` float32 linear, premultiplied,
    in mode scope before the camera. depth_mm, samples: as
    `renderers.snapshots.delivery`. apart_mm: between two eyes, whose pictures are side
    by side; the view is the left one's.
    """

    view: ViewFile
    result: SnapshotResult
    pixels: NDArray[np.uint8]
    rgba: NDArray[np.float32]
    depth_mm: NDArray[np.float32]
    samples: NDArray[np.uint32]
    apart_mm: float | None = None

    @classmethod
    def of(cls, view: ViewFile, snapshot: Snapshot) -> "RenderedPicture":
        """Read a finished job's files."""
        rgba = snapshot.radiance()
        if rgba.shape[2] == 3:
            rgba = np.dstack([rgba, snapshot.coverage()])
        return cls(
            view,
            snapshot.result,
            snapshot.pixels(),
            rgba,
            snapshot.depth_mm(),
            snapshot.samples(),
        )

    def beside(self, other: "RenderedPicture", apart_mm: float) -> "RenderedPicture":
        """Put the right eye's picture to the right of this one."""
        one, two = self.result, other.result
        errors = [each for each in (one.error, two.error) if each is not None]
        result = msgspec.structs.replace(
            one,
            complete=one.complete and two.complete,
            traced=min(one.traced, two.traced),
            error=max(errors, default=None),
            seconds={
                name: one.seconds[name] + two.seconds[name] for name in one.seconds
            },
            camera_in_tissue=one.camera_in_tissue or two.camera_in_tissue,
        )
        return replace(
            self,
            result=result,
            apart_mm=apart_mm,
            pixels=np.hstack([self.pixels, other.pixels]),
            rgba=np.hstack([self.rgba, other.rgba]),
            depth_mm=np.hstack([self.depth_mm, other.depth_mm]),
            samples=np.hstack([self.samples, other.samples]),
        )

    def text(self) -> dict[str, str]:
        """Return what was drawn, as metadata of a file."""
        result = self.result
        noise = "" if result.noise is None else f"{result.noise:.6g}"
        pair = {}
        if self.apart_mm is not None:
            told = f"left and right eye, {self.apart_mm:g} mm apart; View is the left's"
            pair = {"Stereo": told}
        return pair | {
            "Title": self.view.title or "PARAVOL snapshot",
            "Software": f"PARAVOL {versions()['paravol-ess']}",
            "View": msgspec.json.encode(self.view).decode(),
            "Complete": "yes" if result.complete else "no: stopped early",
            "Traced": f"{result.traced:.6g}",
            "Noise": noise,
            "Error": "" if result.error is None else f"{result.error:.6g} codes",
            "Gain": "" if result.gain is None else repr(result.gain),
            "CameraInTissue": "yes" if result.camera_in_tissue else "no",
            "Seconds": f"{result.seconds['total']:.3f}",
        }


def require_endings(files: tuple[Path, ...], *, film: bool) -> None:
    """Raise UserError for an ending that nothing is written to.

    film: pictures in a row: a film, or a folder of numbered stills.
    """
    if not files:
        raise UserError("--out needs a file.")
    for file in files:
        ending = file.suffix.lower()
        if film and ending in (FILM, ""):
            continue
        if not film and ending in STILLS:
            continue
        if film:
            raise UserError(
                f"Pictures in a row go to {FILM} or a folder of PNGs; got {file}."
            )
        raise UserError(f"A picture goes to {', '.join(STILLS)}; got {file}.")


def save_picture(file: Path, picture: RenderedPicture) -> None:
    """Write a picture as PNG, OpenEXR or, of its depth, NRRD."""
    text = picture.text()
    match file.suffix.lower():
        case ".png":
            save_png(file, picture.pixels, text)
        case ".exr":
            save_exr(
                file,
                picture.rgba,
                depth_mm=picture.depth_mm,
                samples=picture.samples,
                text={f"paravol{key}": value for key, value in text.items()},
            )
        case ".nrrd":
            unit = {"Unit": "mm along the ray; infinite where nothing is"}
            save_depth_nrrd(file, picture.depth_mm, text | unit)
        case ending:
            raise UserError(f"A picture goes to {', '.join(STILLS)}; got {ending!r}.")
