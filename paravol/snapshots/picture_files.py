"""Pictures with all their bits, for other programs: OpenEXR and NRRD."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from system import UserError, simple_itk, whole_file


def save_exr(
    path: Path,
    rgba: NDArray[np.float32],
    *,
    depth_mm: NDArray[np.float32] | None = None,
    samples: NDArray[np.uint32] | None = None,
    text: dict[str, str] | None = None,
) -> None:
    """Write linear light as OpenEXR, atomically, without loss.

    rgba: ``(h, w, 4)`` premultiplied. depth_mm: ``(h, w)`` along the rays, +inf where
    nothing is; channel ``Z``. samples: ``(h, w)`` rays of each pixel; channel
    ``samples``. text: attributes of the header. Raises UserError for shapes or types
    that do not fit.
    """
    import OpenEXR

    if rgba.ndim != 3 or rgba.shape[2] != 4 or rgba.dtype != np.float32:
        raise UserError(
            f"a picture is (h, w, 4) float32, got {rgba.shape} {rgba.dtype}"
        )
    channels = {"RGBA": np.ascontiguousarray(rgba)}
    for name, plane, kind in (
        ("Z", depth_mm, np.float32),
        ("samples", samples, np.uint32),
    ):
        if plane is None:
            continue
        if plane.shape != rgba.shape[:2] or plane.dtype != kind:
            raise UserError(
                f"channel {name} must be {kind.__name__} of shape {rgba.shape[:2]}, "
                f"got {plane.dtype} {plane.shape}"
            )
        channels[name] = np.ascontiguousarray(plane)
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        **(text or {}),
    }
    with whole_file(path) as beside:
        OpenEXR.File(header, channels).write(str(beside))


def save_depth_nrrd(
    path: Path, depth_mm: NDArray[np.float32], text: dict[str, str] | None = None
) -> None:
    """Write ``(h, w)`` distances along the rays as a two-dimensional NRRD, atomically.

    Row 0 at the top; +inf where nothing is. text: key-value pairs of the header.
    """
    sitk = simple_itk()

    if depth_mm.ndim != 2 or depth_mm.dtype != np.float32:
        raise UserError(
            f"depth is (h, w) float32, got {depth_mm.shape} {depth_mm.dtype}"
        )
    image = sitk.GetImageFromArray(depth_mm)
    for key, value in (text or {}).items():
        image.SetMetaData(key, value)
    with whole_file(path) as beside:
        sitk.WriteImage(image, str(beside), useCompression=True)
