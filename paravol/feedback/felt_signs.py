"""What both hands of an operation feel, as signs."""

from dataclasses import replace

from anatomy.wall_layers import WallKind
from paravol.feedback.touch_signs import TouchSigns
from scenarios.operation import Operation
from surgery.force import Touch

SOFT = "soft tissue"
"""What is touched where no bone lies behind."""

NAMELESS = "bone"


def felt_signs(
    operation: Operation, hazard: tuple[str, float] | None, bites: int
) -> TouchSigns:
    """Return the signs of the newest sample: of the hand that is nearer to a break.

    hazard: the nearest one and how near, mm. bites: taken so far.
    """
    limits = break_forces_n(operation.patient.layers.kinds)
    tool, scope = (
        _pressed(touch, limits) for touch in (operation.touch, operation.scope_touch)
    )
    felt = scope if scope.share > tool.share else tool
    broken = operation.feeling.figures.breaks
    last = broken[-1] if broken else None
    return replace(
        felt,
        hazard=hazard,
        breaks=len(broken),
        broken="" if last is None else last.wall or NAMELESS,
        broken_n=0.0 if last is None else last.force_n,
        bites=bites,
    )


def break_forces_n(kinds: tuple[WallKind, ...]) -> dict[str, float]:
    """Return by name the least force that breaks a wall, N; of those that break."""
    limits: dict[str, float] = {}
    for kind in kinds:
        if kind.bone_mm > 0.0 and kind.fracture_n > 0.0:
            least = limits.get(kind.name, kind.fracture_n)
            limits[kind.name] = min(least, kind.fracture_n)
    return limits


def _pressed(touch: Touch, limits: dict[str, float]) -> TouchSigns:
    if not touch.is_touching:
        return TouchSigns(force_n=0.0)
    return TouchSigns(touch.size_n, touch.wall or SOFT, limits.get(touch.wall))
