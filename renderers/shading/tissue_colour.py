"""The colour of living tissue, computed from how much blood it holds.

One scalar, the blood volume fraction B, sets absorption; absorption and scattering
set both the diffuse albedo and how far light creeps sideways. So a congested
turbinate is darker, redder *and* harder-edged than a pale septum, by one number.

Chain: haemoglobin extinction (compilation of S. Prahl, Oregon Medical Laser Center)
times B, flattened because blood sits in vessels and not in solution (van Veen et al.,
Opt. Lett. 27, 2002) -> reduced scattering of soft tissue (Jacques, Phys. Med. Biol.
58, 2013) -> total diffuse reflectance of a half space (diffusion dipole, Flock et al.
1989; internal reflection after Groenhuis et al. 1983) -> CIE 1931 colour matching
(Gaussian fits of Wyman, Sloan and Shirley, JCGT 2, 2013) -> linear sRGB primaries,
white balanced. White balance makes any lamp neutral, so no lamp spectrum appears.

Check: the healthy inferior turbinate of 60 people has chromaticity x .4264 +- .0119,
y .3204 +- .0067 (Am. J. Rhinol. 16, 2002); B = .12 gives (.4262, .3274).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

TABLE_SIZE = 256
"""Rows of the colour table: one per code of a blood volume."""

WAVELENGTHS_NM = np.arange(400.0, 701.0, 5.0)

_HAEMOGLOBIN_GRAM_PER_LITRE = 150.0
_HAEMOGLOBIN_GRAM_PER_MOL = 66500.0
_VESSEL_RADIUS_CM = 0.002
"""20 um: the venules that carry most of the mucosa's blood."""
_TISSUE_INDEX = 1.37
_SMALLEST_ALBEDO = 0.003

# wavelength nm, oxygenated, deoxygenated molar extinction 1/(cm M)
_HAEMOGLOBIN = np.array(
    [
        [400, 266232, 223296],
        [410, 466840, 303956],
        [420, 480360, 407560],
        [430, 246072, 528600],
        [440, 102580, 413280],
        [450, 62816, 103292],
        [460, 44480, 23388.8],
        [470, 33209.2, 16156.4],
        [480, 26629.2, 14550],
        [490, 23684.4, 16684],
        [500, 20932.8, 20862],
        [510, 20035.2, 25773.6],
        [520, 24202.4, 31589.6],
        [530, 39956.8, 39036.4],
        [540, 53236, 46592],
        [550, 43016, 53412],
        [560, 32613.2, 53788],
        [570, 44496, 45072],
        [580, 50104, 37020],
        [590, 14400.8, 28324.4],
        [600, 3200, 14677.2],
        [610, 1506, 9443.6],
        [620, 942, 6509.6],
        [630, 610, 5148.8],
        [640, 442, 4345.2],
        [650, 368, 3750.12],
        [660, 319.6, 3226.56],
        [670, 294, 2795.12],
        [680, 277.6, 2407.92],
        [690, 276, 2051.96],
        [700, 290, 1794.28],
    ]
)

# CIE XYZ -> linear sRGB (IEC 61966-2-1)
_RGB_FROM_XYZ = np.array(
    [
        [3.2406, -1.5372, -0.4986],
        [-0.9689, 1.8758, 0.0415],
        [0.0557, -0.2040, 1.0570],
    ]
)


@dataclass(frozen=True, slots=True)
class TissueOptics:
    """Describe a scattering medium.

    blood: volume fraction 0..1. saturation: oxygenated share of haemoglobin.
    scattering_per_cm, scattering_power: reduced scattering ``a (l / 500 nm)**-b``.
    base_per_cm: bloodless absorption at 500 nm. pigment_per_cm: yellow absorber
    (carotene, pus, fat) at 450 nm.
    """

    blood: float
    saturation: float = 0.75
    scattering_per_cm: float = 18.9
    scattering_power: float = 1.286
    base_per_cm: float = 0.25
    pigment_per_cm: float = 0.0

    def coefficients(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return absorption and reduced scattering, 1/cm, at `WAVELENGTHS_NM`."""
        lam = WAVELENGTHS_NM
        oxy = np.interp(lam, _HAEMOGLOBIN[:, 0], _HAEMOGLOBIN[:, 1])
        deoxy = np.interp(lam, _HAEMOGLOBIN[:, 0], _HAEMOGLOBIN[:, 2])
        molar = self.saturation * oxy + (1 - self.saturation) * deoxy
        whole = (
            np.log(10) * molar * _HAEMOGLOBIN_GRAM_PER_LITRE / _HAEMOGLOBIN_GRAM_PER_MOL
        )
        depth = 2 * whole * _VESSEL_RADIUS_CM
        packaged = whole * -np.expm1(-depth) / depth
        absorption = (
            self.blood * packaged
            + self.base_per_cm * np.exp(-(lam - 500) / 120)
            + self.pigment_per_cm * np.exp(-(((lam - 450) / 45) ** 2))
        )
        scattering = self.scattering_per_cm * (lam / 500) ** -self.scattering_power
        return absorption, scattering

    def reflectance(self) -> NDArray[np.float64]:
        """Return the total diffuse reflectance at `WAVELENGTHS_NM`."""
        absorption, scattering = self.coefficients()
        n = _TISSUE_INDEX
        internal = -1.440 / n**2 + 0.710 / n + 0.668 + 0.0636 * n
        boundary = (1 + internal) / (1 - internal)
        albedo = scattering / (scattering + absorption)
        s = np.sqrt(3 * (1 - albedo))
        dipole: NDArray[np.float64] = (
            0.5 * albedo * (1 + np.exp(-4 / 3 * boundary * s)) * np.exp(-s)
        )
        return dipole

    def color(self) -> NDArray[np.float64]:
        """Return the white-balanced linear RGB albedo ``(3,)``."""
        white = _RGB_FROM_XYZ @ _xyz(np.ones_like(WAVELENGTHS_NM))
        rgb = _RGB_FROM_XYZ @ _xyz(self.reflectance()) / white
        return np.maximum(rgb, _SMALLEST_ALBEDO)

    def diffusion_lengths_mm(self) -> tuple[float, float]:
        """Return ``1 / sqrt(3 mua (mua + mus'))``: red (620 nm), green (545 nm)."""
        absorption, scattering = self.coefficients()
        length_mm = 10 / np.sqrt(3 * absorption * (absorption + scattering))
        red, green = (
            np.average(
                length_mm, weights=np.exp(-(((WAVELENGTHS_NM - middle) / 25) ** 2))
            )
            for middle in (620.0, 545.0)
        )
        return float(red), float(green)


POLYP = TissueOptics(0.006, 0.7, 12.0, 1.0, 0.35, 2.0)
"""Watery oedema: little blood, little scattering, a yellow tinge."""
BONE = TissueOptics(0.003, 0.8, 30.0, 0.7, 0.25, 1.0)
FRESH_BLOOD = TissueOptics(1.0, 0.95, 20.0, 1.0)
RAW_FLESH = TissueOptics(0.30, 0.9)
"""What lies under mucosa, torn: its vessels are open, blood has soaked it."""
BONE_EDGE = TissueOptics(0.05, 0.85, 22.0, 1.0)
"""Cover of a bone and threads of it: pale, hardly any vessels."""
CUT_BONE = TissueOptics(0.015, 0.85, 18.0, 0.7, 0.9, 0.3)
"""Living bone: moist and with a trace of blood, duller than dry bone is."""
DEEP_TISSUE = TissueOptics(0.40, 0.85, 16.0)
"""Muscle and fat behind a wall."""

SKIN_COLOR = (0.47, 0.235, 0.18)
"""Linear albedo of vestibular skin: the model's skin, reddened towards mucosa."""


@cache
def colour_table() -> NDArray[np.float32]:
    """Tabulate ``(256, 5)`` float32 rows by ``sqrt(B)``.

    Row i belongs to ``B = (i / 255)**2``. Columns: linear albedo red, green, blue;
    diffusion length in mm of red and of green light. The square root spends the rows
    where the colour changes fastest, and is how blood volumes are stored.
    """
    table = np.empty((TABLE_SIZE, 5), np.float32)
    for i in range(TABLE_SIZE):
        table[i] = colour_row(TissueOptics(max((i / (TABLE_SIZE - 1)) ** 2, 1e-4)))
    table.flags.writeable = False
    return table


def colour_row(optics: TissueOptics) -> NDArray[np.float32]:
    """Return a medium's row of `colour_table`: albedo, and two diffusion lengths."""
    row = np.empty(5, np.float32)
    row[:3] = optics.color()
    row[3:] = optics.diffusion_lengths_mm()
    return row


def _xyz(reflectance: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, z = _colour_matching()
    xyz = np.array([(reflectance * m).sum() for m in (x, y, z)], dtype=np.float64)
    xyz /= y.sum()
    return xyz


def _colour_matching() -> tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]
]:
    """Return the CIE 1931 functions as sums of two-sided Gaussians."""

    def lobe(
        height: float, peak: float, below: float, above: float
    ) -> NDArray[np.float64]:
        distance = WAVELENGTHS_NM - peak
        width = np.where(distance < 0, below, above)
        value: NDArray[np.float64] = height * np.exp(-0.5 * (distance / width) ** 2)
        return value

    x = (
        lobe(1.056, 599.8, 37.9, 31.0)
        + lobe(0.362, 442.0, 16.0, 26.7)
        + lobe(-0.065, 501.1, 20.4, 26.2)
    )
    y = lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1)
    z = lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8)
    return x, y, z
