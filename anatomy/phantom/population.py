"""Virtual patients drawn from published distributions."""

import msgspec
import numpy as np

from anatomy.phantom.parameters import PATIENTS, LeftRatios, PhantomParameters
from anatomy.phantom.sphenoid import pneumatization
from anatomy.phantom.variants import SIDE_CORRELATION, draw_variants
from anatomy.tissue import Side

_FRONTAL_APLASIA = 0.04
"""Share of heads without frontal sinuses; published figures are 3-5 %."""

_SPREAD_MM = 2.2
"""Of places: distances from the nasal spine have standard deviations of 4.4 to 5.0 mm
(140 CTs, `tests/accuracy/test_phantom.py`), of which size accounts for 1.5 to 1.9."""

_KEROS = (5.4, 1.7)
"""Mean and standard deviation of the olfactory fossa's depth, mm (1200 CTs, PMID
30662198; Keskek 2021, 770 sides)."""

_KEROS_CORRELATION = 0.85
"""Of the two fossae's depths: they differ by 0.7 mm in the mean, which is a choice."""


def draw_parameters(seed: int) -> PhantomParameters:
    """Draw one adult: sizes of both sides, places, septum, skull base, cells, variants.

    Left and right are correlated (0.6). The same seed gives the same patient.
    """
    rng = np.random.default_rng([seed, 0x706F])
    scales: dict[str, float] = {}
    ratios: dict[str, float] = {}
    weight, rest = np.sqrt(SIDE_CORRELATION), np.sqrt(1 - SIDE_CORRELATION)
    hidden: dict[str, list[float]] = {}
    for sinus in ("maxillary", "frontal", "sphenoid", "ethmoid"):
        shared, right, left = rng.standard_normal(3)
        hidden[sinus] = [float(weight * shared + rest * own) for own in (right, left)]
    for sinus, sizes in PATIENTS.sizes.items():
        mean, spread = sizes.ml
        ml = [mean + spread * size for size in hidden[sinus]]
        factor = np.interp(ml, sizes.volumes_ml, sizes.factors)
        scales[sinus] = float(factor[0].round(4))
        ratios[sinus] = float((factor[1] / factor[0]).round(4))
    if rng.random() < _FRONTAL_APLASIA:
        scales["frontal"] = 0.0
    # Two of three septa deviate; the others are straight within a millimetre.
    deviated = rng.random() < 0.68
    bend = rng.uniform(1.5, 5.0) if deviated else rng.uniform(0.0, 1.0)
    drawn = PhantomParameters(
        seed=seed,
        head_scale=float(np.clip(rng.normal(1.0, 0.03), 0.93, 1.06).round(4)),
        spread_mm=_SPREAD_MM,
        septal_deviation_mm=float(np.round(bend * rng.choice([-1.0, 1.0]), 3)),
        roof_mm=float(np.clip(rng.normal(0.0, 1.5), -2.8, 2.8).round(3)),
        keros_mm=float(np.clip(rng.normal(*_KEROS), 1.5, 11.5).round(3)),
        congestion=float(np.round(0.25 * rng.random(), 3)),
        maxillary_scale=scales["maxillary"],
        frontal_scale=scales["frontal"],
        ethmoid_scale=scales["ethmoid"],
        left=LeftRatios(**ratios),
        anterior_cells=int(np.clip(np.round(rng.normal(7, 1.1)), 5, 9)),
        posterior_cells=int(np.clip(np.round(rng.normal(4, 0.8)), 3, 6)),
        mucosa_mm=float(np.clip(rng.normal(0.38, 0.06), 0.25, 0.5).round(3)),
        variants=draw_variants(rng),
    )
    ratio = _fossa_ratio(seed, drawn.keros_mm)
    left = msgspec.structs.replace(drawn.left, keros=ratio)
    drawn = msgspec.structs.replace(drawn, left=left)
    return _with_sphenoids(drawn, hidden["sphenoid"])


def _with_sphenoids(drawn: PhantomParameters, sizes: list[float]) -> PhantomParameters:
    """Size the sphenoid sinuses by their kinds; sizes: normal, of right and left."""
    factors = []
    for side, size in zip((Side.RIGHT, Side.LEFT), sizes, strict=True):
        kind = PATIENTS.sphenoids[pneumatization(drawn, side)]
        mean, spread = kind.ml
        factors.append(np.interp(mean + spread * size, kind.volumes_ml, kind.factors))
    right, left = factors
    ratios = msgspec.structs.replace(
        drawn.left, sphenoid=float((left / right).round(4))
    )
    return msgspec.structs.replace(
        drawn, sphenoid_scale=float(right.round(4)), left=ratios
    )


def _fossa_ratio(seed: int, right_mm: float) -> float:
    """Draw how much deeper the left olfactory fossa is than the right one."""
    mean, spread = _KEROS
    own = np.random.default_rng([seed, 0x6B65]).normal(
        0.0, spread * np.sqrt(1 - _KEROS_CORRELATION**2)
    )
    left_mm = np.clip(mean + _KEROS_CORRELATION * (right_mm - mean) + own, 1.5, 11.5)
    return float((left_mm / right_mm).round(4))
