"""How far one picture is from another, as numbers.

Linear-light errors (RMSE, largest, 99.9th percentile, signed mean) decide; SSIM on
the encoded picture is added because it sees structure. SSIM alone is blind to gain
and nearly blind to mirroring, RMSE alone to a few wrong pixels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class ImageError:
    """Report `rmse`, `p999`, `max` of |difference| and the signed mean `bias`."""

    rmse: float
    p999: float
    max: float
    bias: float


def image_error(
    image: NDArray[np.floating], reference: NDArray[np.floating]
) -> ImageError:
    """Compare two arrays of equal shape (linear RGB or RGBA) in float64."""
    if image.shape != reference.shape:
        raise ValueError(f"shapes differ: {image.shape} and {reference.shape}")
    difference = image.astype(np.float64) - reference.astype(np.float64)
    size = np.abs(difference)
    return ImageError(
        rmse=float(np.sqrt(np.mean(difference**2))),
        p999=float(np.percentile(size, 99.9)),
        max=float(size.max()),
        bias=float(difference.mean()),
    )


def rmse_codes(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    """Return the RMS difference of two encoded pictures in 8-bit codes."""
    return float(np.sqrt(np.mean((a.astype(np.float64) - b.astype(np.float64)) ** 2)))


def ssim(
    a: NDArray[np.uint8] | NDArray[np.float32],
    b: NDArray[np.uint8] | NDArray[np.float32],
) -> float:
    """Return the mean structural similarity of two encoded pictures, in 8-bit codes.

    Codes need not be rounded: in a picture of even walls rounding alone costs 1e-3.

    Wang et al. 2004: 11 x 11 Gaussian of sigma 1.5, K1 .01, K2 .03, data range 255,
    channels averaged; a border of 5 pixels is left out.
    """
    from scipy.ndimage import gaussian_filter

    if a.shape != b.shape or a.ndim not in (2, 3) or min(a.shape[:2]) < 11:
        raise ValueError(f"SSIM needs equal pictures of >= 11 px: {a.shape} {b.shape}")
    x, y = a.astype(np.float64), b.astype(np.float64)
    sigma = (1.5, 1.5) if a.ndim == 2 else (1.5, 1.5, 0)

    def smooth(v: NDArray[np.float64]) -> NDArray[np.float64]:
        # truncate at radius 5, the half width of the 11-pixel window
        result: NDArray[np.float64] = gaussian_filter(v, sigma, truncate=5.0 / 1.5)
        return result

    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    mx, my = smooth(x), smooth(y)
    vx, vy = smooth(x * x) - mx * mx, smooth(y * y) - my * my
    cov = smooth(x * y) - mx * my
    score = ((2 * mx * my + c1) * (2 * cov + c2)) / (
        (mx * mx + my * my + c1) * (vx + vy + c2)
    )
    return float(score[5:-5, 5:-5].mean())
