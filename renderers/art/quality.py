"""How finely a picture is computed."""

from dataclasses import dataclass
from typing import Literal, get_args

from system import UserError

ClassificationName = Literal["post", "integrated"]


@dataclass(frozen=True, slots=True)
class Quality:
    """Set the step and where rays stop.

    step_voxels: step in units of the smallest voxel spacing.
    cutoff: a ray ends when its transmittance falls below; what it then leaves out
        changes no channel by more than `cutoff` times the brightest colour behind.
    renormalise: divide a ray by its opacity where it was cut, which lowers the error
        of a large cutoff inside opaque tissue and raises it in thin tissue.
    compact: keep values and gradients of volumes of whole numbers as int16: half the
        memory, faster; places along y are rounded to 1/32767 voxel and gradients to
        1/32767 of the steepest. Volumes that int16 cannot hold stay float32.
    skip_empty: leap over what the transfer function makes clear. The picture is the
        same bit for bit; off only to measure what skipping saves.
    classification: how mode `classic` reads the transfer function. "post": a step has
        what its middle has. "integrated": it has what the transfer function says all
        along from the density at its one end to that at its other: jumps and thin
        spikes are met at any step, for more work a step.
    tolerance: what integrated steps may leave out, root mean square over lines through
        the scene; where `step_voxels` leaves more, steps are shortened for the scene
        (`step_estimation`). None takes `step_voxels` as it is.
    """

    step_voxels: float
    cutoff: float
    renormalise: bool = False
    compact: bool = False
    skip_empty: bool = True
    classification: ClassificationName = "post"
    tolerance: float | None = None

    def __post_init__(self) -> None:
        if not 1 / 256 <= self.step_voxels <= 4:
            raise UserError(f"step must be 1/256 to 4 voxels, got {self.step_voxels!r}")
        if not 0 <= self.cutoff < 0.5:
            raise UserError(f"cutoff must be 0 to .5, got {self.cutoff!r}")
        if self.classification not in get_args(ClassificationName):
            raise UserError(
                f"classification must be post or integrated, got "
                f"{self.classification!r}"
            )
        if self.tolerance is not None and not 0 < self.tolerance < 1:
            raise UserError(
                f"the tolerance must be between 0 and 1, got {self.tolerance!r}"
            )

    @classmethod
    def named(cls, name: str) -> "Quality":
        """Look up preview, snapshot, final or reference."""
        if name not in QUALITIES:
            raise UserError(
                f"no quality is called {name!r}; choose from {', '.join(QUALITIES)}"
            )
        return QUALITIES[name]


QUALITIES = {
    "preview": Quality(
        1.0, 1 / 255, compact=True, classification="integrated", tolerance=2.2e-3
    ),
    "snapshot": Quality(
        0.5, 1 / 1024, compact=True, classification="integrated", tolerance=1e-3
    ),
    "final": Quality(0.25, 1e-4, classification="integrated", tolerance=5e-4),
    "reference": Quality(1 / 32, 0.0, classification="integrated"),
}
"""Named settings, for pictures within an RMSE of 4e-3, 1.5e-3 and 5e-4. A cutoff is at
most half the error aimed at: 1/255 alone leaves an RMSE floor of 1.8e-3 on a phantom
head (measured). Integrated, since post-classified steps as long leave 2.8 to 6.6 times
the error in that head, more than is aimed at."""
