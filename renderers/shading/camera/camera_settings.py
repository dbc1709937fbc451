"""What the scope's camera does to light, as numbers."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """Set what the camera does to light; widths in pixels of a 480 px picture.

    focus_mm, defocus_px: blur radius ``defocus_px * max(|6/t - 6/focus_mm| - .12, 0)``.
    soft_px, softer_px: the Gaussians that radius is blended from.
    glare_px, glare, halo_px, halo: bloom of the part above white.
    lateral: relative size difference of red (+) and blue (-) against green.
    vignette: power of cos(.9 theta). stray: light scattered in the lens.
    contrast: exponent about middle grey. saturation; knee: where the shoulder starts,
    ``knee + (1 - knee) u / (1 + u)`` with u = (c - knee) / (1 - knee), which no
    light fills: walls beside the lens keep their shading. keep_hue: share of the
    shoulder that acts on the largest channel alone, of colours far from grey: with
    little of it a bright wall turns from red to pink. What is nearly white goes white.
    noise: sd of the grain at white. stop: draw the round field stop and its notch.
    """

    focus_mm: float = 12.0
    defocus_px: float = 1.3
    soft_px: float = 0.8
    softer_px: float = 1.8
    glare: float = 0.20
    halo_px: float = 8.0
    halo: float = 0.10
    lateral: float = 0.0012
    vignette: float = 1.5
    stray: float = 0.003
    contrast: float = 1.12
    saturation: float = 1.15
    knee: float = 0.45
    keep_hue: float = 0.85
    noise: float = 0.006
    noise_floor: float = 0.15
    stop: bool = True

    def __post_init__(self) -> None:
        if not self.focus_mm > 0:
            raise ValueError(f"focus must be a distance > 0 mm, got {self.focus_mm}")
        if not 0 < self.soft_px < self.softer_px:
            raise ValueError(
                f"blur widths must grow, got {self.soft_px} and {self.softer_px} px"
            )
        if not 0 <= self.knee <= 1:
            raise ValueError(f"the shoulder's knee lies within 0..1, got {self.knee}")

    @classmethod
    def plain(cls) -> "CameraSettings":
        """Return a camera that only exposes and encodes."""
        return cls(
            defocus_px=0,
            glare=0,
            halo=0,
            lateral=0,
            vignette=0,
            stray=0,
            contrast=1,
            saturation=1,
            knee=1,
            keep_hue=0,
            noise=0,
            stop=False,
        )
