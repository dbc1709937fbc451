"""One change of the patient: what was cut, with what, and what came away."""

from dataclasses import dataclass, field

from renderers.scene.change import Change
from surgery.solids import Rows


@dataclass(frozen=True, slots=True)
class CuttingLimits:
    """What a tool can take away.

    force_n: axial force that it brings on bone; walls and grounds that bear more stay.
    bone_mm: thickest plate of bone that it takes; 0 spares all bone.
    """

    force_n: float = 0.0
    bone_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class Edit:
    """Record what one cut took.

    number: counts edits from 1; time_s: of the sample that made it. stroke: edits of
    one stroke are undone together. tool: its name. solids: what was cut out, see
    `surgery.solids`. taken_mm3: by tissue. bone_mm3: of them bone of walls, by the
    walls' names. pieces_mm3: of them what had become loose. counts: the sum in shares
    of a voxel, an integer, see `surgery.patient.VolumeLedger`. change: for who
    shows it.
    """

    number: int
    time_s: float
    stroke: int
    tool: str
    solids: Rows
    taken_mm3: dict[str, float]
    bone_mm3: dict[str, float]
    pieces_mm3: float
    counts: int
    change: Change = field(repr=False)

    @property
    def volume_mm3(self) -> float:
        """Return all that was taken."""
        return sum(self.taken_mm3.values())
