"""How tissue feels under a tool: stiffness, friction and damping, and who says so.

Stiffness is what a blunt tip of 2 mm meets. Little of it was ever measured in the nose:
each figure says whether it is from the literature or a guess, and `docs/feel.md` lists
them all. The forces at which walls break are in `anatomy.tissue`.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from anatomy.tissue import TISSUE_NAMES, TISSUE_OF, TISSUES, Label
from anatomy.wall_layers import NO_FEEL, WallFeel, WallKind

GUESS = "guess"

SOURCES = {
    "punch": "Am J Rhinol Allergy 2010;24 (3374), times 1.5: Allergy Rhinol 2012;3:e61",
    "curette": "Allergy Rhinol 2012;3:e61: 6.4 N in cadavers, times 1.5",
}
"""Who measured the forces at which walls break."""

BARE_FRICTION = 0.25
"""Of bone and cartilage without mucosa."""

SOFT_DAMPING_NS_MM, HARD_DAMPING_NS_MM = 5e-4, 2e-4
"""Of soft tissue, and of what has bone or cartilage under a tool's tip."""

HARD_N_MM = 1.5
"""Tissue that is at least so stiff feels hard."""


def friction_of(name: str) -> float:
    """Return Coulomb's friction of a tissue against a tool."""
    if TISSUES[name].stiffness_n_mm >= HARD_N_MM:
        return BARE_FRICTION
    return TISSUES[name].friction


def feel_of(kind: WallKind) -> WallFeel:
    """Return how a wall feels; one that does not say so, as its tissues do."""
    if kind.feel != NO_FEEL:
        return kind.feel
    soft, hard = _name(kind.mucosa, "mucosa"), _name(kind.bone, "bone")
    has_bone = kind.bone_mm > 0.0
    if has_bone and kind.fracture_n > 0.0 and TISSUES[hard].fracture_n == 0.0:
        # a plate that breaks bends first
        hard = "thin bone"
    is_hard = has_bone or TISSUES[soft].stiffness_n_mm >= HARD_N_MM
    breaks = kind.fracture_n > 0.0 and has_bone
    return WallFeel(
        soft_n_mm=TISSUES[soft].stiffness_n_mm,
        hard_n_mm=TISSUES[hard].stiffness_n_mm if has_bone else 0.0,
        friction=friction_of(hard if has_bone and kind.mucosa_mm == 0.0 else soft),
        damping_ns_mm=HARD_DAMPING_NS_MM if is_hard else SOFT_DAMPING_NS_MM,
        soft_source=GUESS,
        hard_source=GUESS if has_bone else "",
        friction_source=GUESS,
        break_source=SOURCES.get(TISSUES[hard].measured_by, GUESS) if breaks else "",
    )


def with_feel(kind: WallKind) -> WallKind:
    """Return a wall that says how it feels, to be stored."""
    return replace(kind, feel=feel_of(kind))


def _name(label: int, other: str) -> str:
    """Return the name of a label's tissue; of air, or of no label, another's."""
    name = TISSUE_NAMES.get(label, other)
    return other if name == "air" else name


LEAST_N_MM = 0.01
"""What is liquid holds a tool so much, or it would fall through a head."""


def ground_stiffness() -> NDArray[np.float64]:
    """Return ``(256,)`` N/mm by `Label`; what nobody names is soft tissue."""
    table = np.full(256, TISSUES["mucosa"].stiffness_n_mm)
    for label, tissue in TISSUE_OF.items():
        if label >= Label.MUCOSA:
            table[label] = max(tissue.stiffness_n_mm, LEAST_N_MM)
    return table
