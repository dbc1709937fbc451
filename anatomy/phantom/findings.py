"""Disease and traces of surgery by words, such as ``fluid:maxillary:left=0.4``."""

import math
from collections.abc import Iterable
from typing import Literal, get_args

import msgspec

from anatomy.phantom.parameters import (
    SINUSES,
    Finding,
    FindingKind,
    Opacity,
    PhantomParameters,
)
from disk import UserError

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
