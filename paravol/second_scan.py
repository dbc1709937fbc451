"""A second scan of the same head, laid onto the first."""

from dataclasses import dataclass

from anatomy.scan.imported import ImportedHead
from anatomy.scan.scan import Modality, Scan
from anatomy.scan.volume_registration import register_volumes, resampled
from disk import UserError
from paravol.patient import Progress
from renderers.scene import Volume


@dataclass(frozen=True, slots=True)
class SecondScan:
    """Hold the second scan on the head's grid and how well it fits.

    quality: figures by name, rounded for a person.
    """

    on_grid: Volume
    quality: dict[str, float]


def check_second(first: Scan, second: Scan) -> None:
    """Raise ValueError unless these are a CT and an MR to be laid onto it."""
    if (first.modality, second.modality) != (Modality.CT, Modality.MR):
        raise UserError(
            f"a second scan is an MR laid onto a CT; got {second.modality.value} onto "
            f"{first.modality.value}: name the CT first"
        )


def lay_second(
    head: ImportedHead, first: Scan, second: Scan, progress: Progress
) -> SecondScan:
    """Register an MR to the CT that the head was made of.

    Raises ValueError when they do not fit.
    """
    found = register_volumes(first.volume, second.volume, progress)
    quality = {
        "return_mm": round(found.return_mm, 2),
        "shared": round(found.shared, 3),
        "overlap": round(found.overlap, 3),
    }
    return SecondScan(resampled(second.volume, found, head.ct), quality)
