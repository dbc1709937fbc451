"""What a patient has, by words: variants of anatomy, disease, traces of surgery."""

import difflib
import math
from collections.abc import Iterable
from statistics import NormalDist
from typing import Literal, get_args

import msgspec
import numpy as np

from anatomy.phantom.parameters import (
    EXCLUSIVE,
    PATIENTS,
    SIDED_VARIANTS,
    SINUSES,
    SPHENOID_KINDS,
    Finding,
    FindingKind,
    LeftRatios,
    Opacity,
    PhantomParameters,
)
from anatomy.tissue import Side
from system import UserError

PREVALENCE = PATIENTS.prevalence
"""Share of sides with each variant, in the order in which they are drawn."""

SIDE_CORRELATION = 0.6
"""Correlation of the hidden normal variables of the two sides."""

KEROS_MM = {"keros-1": 2.4, "keros-2": 5.3, "keros-3": 9.0}
KEROS_LIMITS_MM = 3.5, 7.5
DEVIATION_MM = 4.0
HYPOPLASTIC_SCALE = {"maxillary": 0.64, "frontal": 0.56}

NAMES = (
    *SIDED_VARIANTS,
    "septal-deviation",
    "hypoplastic-maxillary",
    "hypoplastic-frontal",
    "frontal-aplasia",
    *KEROS_MM,
)
"""All names that `with_variants` knows."""


def with_variants(
    parameters: PhantomParameters, names: Iterable[str]
) -> PhantomParameters:
    """Add variants by name, such as ``"onodi:left"``, ``"haller"`` or ``"keros-3"``.

    Without a side both sides get it; a deviated septum then bends to the right. What a
    name excludes on its side gives way. Raise UserError for an unknown name or side.
    """
    for name in names:
        parameters = _with_variant(parameters, name)
    return parameters


def without_variants(
    parameters: PhantomParameters, names: Iterable[str]
) -> PhantomParameters:
    """Remove sided variants by name, from both sides if none is given."""
    dropped: set[str] = set()
    for name in names:
        word, sides = _parsed(name)
        if word not in SIDED_VARIANTS:
            raise UserError(f"{word!r} cannot be removed; ask for what it should be")
        dropped |= {f"{word}:{side}" for side in sides}
    kept = tuple(v for v in parameters.variants if v not in dropped)
    return msgspec.structs.replace(parameters, variants=kept)


def variant_names(parameters: PhantomParameters) -> tuple[str, ...]:
    """Name what a patient has, as `with_variants` takes it.

    Of Keros there is always one name, or one for each side where they differ.

    Depths and sizes have a name from what `with_variants` sets on; those of Keros hold
    to the nearest millimetre: 1 to 3, 4 to 7, 8 and more (Keros, Z. Laryngol. Rhinol.
    Otol. 41, 1962).
    """
    found = list(parameters.variants)
    deviation = parameters.septal_deviation_mm
    if abs(deviation) >= DEVIATION_MM:
        found.append(f"septal-deviation:{'right' if deviation > 0 else 'left'}")
    for sinus, least in HYPOPLASTIC_SCALE.items():
        right = getattr(parameters, f"{sinus}_scale")
        left = right * getattr(parameters.left, sinus)
        for side, scale in (("left", left), ("right", right)):
            if scale == 0:
                found.append(f"{sinus}-aplasia:{side}")
            elif scale < least + 1e-9:
                found.append(f"hypoplastic-{sinus}:{side}")
    right, left = (
        f"keros-{1 + sum(parameters.keros(s) >= limit for limit in KEROS_LIMITS_MM)}"
        for s in (Side.RIGHT, Side.LEFT)
    )
    if right == left:
        return (*found, right)
    return (*found, f"{right}:right", f"{left}:left")


def _parsed(name: str) -> tuple[str, tuple[str, ...]]:
    word, colon, side = name.partition(":")
    if word not in NAMES:
        near = difflib.get_close_matches(word, NAMES, 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise UserError(
            f"there is no variant {word!r}{hint}; the names are {', '.join(NAMES)}"
        )
    if colon and side not in ("left", "right"):
        raise UserError(f"the side of {name!r} must be left or right, got {side!r}")
    return word, (side,) if colon else ("left", "right")


def _with_variant(parameters: PhantomParameters, name: str) -> PhantomParameters:
    word, sides = _parsed(name)
    change = msgspec.structs.replace
    if word in SIDED_VARIANTS:
        rivals = {name for group in EXCLUSIVE if word in group for name in group}
        given = {f"{word}:{side}" for side in sides}
        gone = {f"{name}:{side}" for name in rivals for side in sides}
        kept = (set(parameters.variants) - gone) | given
        return change(parameters, variants=tuple(sorted(kept)))
    if word in KEROS_MM:
        right, left = (
            KEROS_MM[word] if s.name.lower() in sides else parameters.keros(s)
            for s in (Side.RIGHT, Side.LEFT)
        )
        ratios = change(parameters.left, keros=left / right)
        return change(parameters, keros_mm=right, left=ratios)
    if word == "septal-deviation":
        sign = -1.0 if sides == ("left",) else 1.0
        return change(parameters, septal_deviation_mm=sign * DEVIATION_MM)
    if word == "frontal-aplasia":
        return _scaled(parameters, "frontal", 0.0, sides)
    sinus = word.removeprefix("hypoplastic-")
    return _scaled(parameters, sinus, HYPOPLASTIC_SCALE[sinus], sides)


def _scaled(
    parameters: PhantomParameters, sinus: str, scale: float, sides: tuple[str, ...]
) -> PhantomParameters:
    """Set one sinus's factor on the given sides and keep it on the other."""
    field = f"{sinus}_scale"
    right = getattr(parameters, field)
    left = right * getattr(parameters.left, sinus)
    right = scale if "right" in sides else right
    left = scale if "left" in sides else left
    if right == 0 and left > 0:
        raise UserError(
            f"a head without a right {sinus} sinus alone cannot be built; "
            f"leave out the side or take the left"
        )
    ratio = left / right if right > 0 else 1.0
    ratios: LeftRatios = msgspec.structs.replace(parameters.left, **{sinus: ratio})
    return msgspec.structs.replace(parameters, left=ratios, **{field: right})


def draw_variants(rng: np.random.Generator) -> tuple[str, ...]:
    """Draw the sided variants with their prevalences; sides are correlated.

    A sphenoid's kinds are slices of one hidden variable. A conchal one has no recess.
    """
    found: set[str] = set()
    for name, share in PREVALENCE.items():
        if name in SPHENOID_KINDS or share == 0.0:
            continue
        for side, hidden in _both_sides(rng):
            if hidden < share:
                found.add(f"{name}:{side}")
    for side, hidden in _both_sides(rng):
        for name in SPHENOID_KINDS:
            low, high = kind_slice(name)
            if low <= hidden < high:
                found.add(f"{name}:{side}")
        if f"conchal-sphenoid:{side}" in found:
            found.discard(f"lateral-recess:{side}")
    return tuple(sorted(found))


def kind_slice(name: str) -> tuple[float, float]:
    """Return the shares of sides between which a kind of sphenoid lies, small to large.

    Sellar sinuses, which have no name, lie between the last two.
    """
    conchal, presellar, postsellar = (PREVALENCE[kind] for kind in SPHENOID_KINDS)
    return {
        "conchal-sphenoid": (0.0, conchal),
        "presellar-sphenoid": (conchal, conchal + presellar),
        "postsellar-sphenoid": (1.0 - postsellar, 1.0),
    }[name]


def _both_sides(rng: np.random.Generator) -> list[tuple[str, float]]:
    """Draw uniform numbers for left and right out of correlated normal ones."""
    shared, right, left = rng.standard_normal(3)
    weight, rest = np.sqrt(SIDE_CORRELATION), np.sqrt(1 - SIDE_CORRELATION)
    return [
        (side, NormalDist().cdf(weight * shared + rest * own))
        for side, own in (("left", left), ("right", right))
    ]


SIDES: tuple[Literal["right"], Literal["left"]] = ("right", "left")
KINDS: tuple[FindingKind, ...] = get_args(FindingKind)

GRAMMAR = (
    f"NAME:SIDE=SCORE with a name out of {', '.join(Opacity.__struct_fields__)}; "
    f"KIND:SINUS:SIDE=SIZE with a kind out of {', '.join(KINDS)} and a sinus out of "
    f"{', '.join(SINUSES)}; antrostomy:SIDE=MM2, congestion=SHARE or "
    "posture=supine|upright"
)
"""What a word may be; without a side both sides are meant."""


def with_findings(
    parameters: PhantomParameters, words: Iterable[str]
) -> PhantomParameters:
    """Give a head disease and traces of surgery, see `GRAMMAR`.

    A word may be several with commas between. UserError for a word that reads
    otherwise, or a number out of range.
    """
    for word in (part.strip() for text in words for part in text.split(",") if part):
        parameters = _with_finding(parameters, word)
    return parameters


def is_healthy(parameters: PhantomParameters) -> bool:
    """Return whether nothing fills a sinus or the nose; surgery is no disease."""
    return parameters.opacity == (Opacity(), Opacity()) and not parameters.findings


def told_findings(parameters: PhantomParameters) -> tuple[str, ...]:
    """Name findings, polyps and traces of surgery as `with_findings` takes them."""
    told = [f"{f.kind}:{f.sinus}:{f.side}={f.size:g}" for f in parameters.findings]
    for side, held, area in zip(
        SIDES, parameters.opacity, parameters.antrostomy_mm2, strict=True
    ):
        if held.polyps:
            told.append(f"polyps:{side}={held.polyps}")
        if area:
            told.append(f"antrostomy:{side}={area:g}")
    return tuple(told)


def _with_finding(parameters: PhantomParameters, word: str) -> PhantomParameters:
    target, equals, text = word.partition("=")
    names = target.replace("-", "_").split(":")
    change = msgspec.structs.replace
    if equals and names == ["posture"]:
        if text not in ("supine", "upright"):
            raise UserError(f"the posture is supine or upright, got {word!r}")
        return change(parameters, posture=text)
    if equals and names == ["congestion"]:
        return change(parameters, congestion=_number(word, text))
    sides: tuple[Literal["right", "left"], ...] = SIDES
    if len(names) > 1 + (names[0] in KINDS):
        last = names.pop()
        sides = tuple(side for side in SIDES if side == last)
        if not sides:
            raise UserError(f"the side in {word!r} must be left or right")
    if equals and names == ["antrostomy"]:
        area = _number(word, text)
        areas = (
            area if side in sides else held
            for side, held in zip(SIDES, parameters.antrostomy_mm2, strict=True)
        )
        return change(parameters, antrostomy_mm2=tuple(areas))
    for kind in KINDS:
        if equals and names[0] == kind and len(names) == 2:
            size = _number(word, text)
            fresh = tuple(
                Finding(kind=kind, sinus=names[1], side=side, size=size)
                for side in sides
            )
            where = {(kind, names[1], side) for side in sides}
            kept = [
                f for f in parameters.findings if (f.kind, f.sinus, f.side) not in where
            ]
            return change(parameters, findings=(*kept, *fresh))
    if not equals or len(names) != 1 or names[0] not in Opacity.__struct_fields__:
        raise UserError(f"disease reads {GRAMMAR}; got {word!r}")
    if not text.isdecimal():
        raise UserError(f"the score in {word!r} must be a whole number")
    right, left = (
        change(held, **{names[0]: int(text)}) if side in sides else held
        for side, held in zip(SIDES, parameters.opacity, strict=True)
    )
    return change(parameters, opacity=(right, left))


def _number(word: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"what follows the = in {word!r} must be a number")
    return value
