"""`paravol slices`: write the picture, print what is at the point."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec

from app.cli.root import Json, Place
from app.cli.terminal import ProgressReporter, print_json
from system import UserError

if TYPE_CHECKING:
    from anatomy.case import CaseRecord


def slices(
    case: Path,
    *,
    at: Place | None = None,
    show: Literal["ct", "mr", "both"] = "ct",
    labels: Literal["outlines", "tint", "none"] = "outlines",
    out: Path | None = None,
    json: Json = False,
) -> int:
    """Draw three planes of a case, and its histogram with the transfer function.

    Parameters
    ----------
    case
        A case folder, as import and phantom write.
    at
        Point the planes go through: x y z in millimetres, patient LPS; the entrance
        when left out.
    show
        The CT, the second scan, or bone from the CT over soft tissue from the MR.
    labels
        What was found, passages and cavities or a phantom's structures, as outlines, as
        a light tint, or not at all; a legend below names the colours.
    out
        PNG file to write; slices.png in the case when left out.
    """
    import numpy as np

    from anatomy.case import read_case
    from paravol.slices.slice_sheet import (
        entrance_of,
        label_at,
        slice_sheet,
        transfer_of,
    )
    from paravol.slices.slice_views import Show
    from renderers.scene import save_png

    target = case / "slices.png" if out is None else out
    if target.suffix.lower() != ".png":
        raise UserError(f"--out must name a .png file, got {target}.")
    with ProgressReporter() as stages:
        stages("Reading the case", 0.0)
        read = read_case(case)
        stages("Reading the case", 1.0)
        place = entrance_of(read) if at is None else np.array(at)
        sheet = slice_sheet(read, place, Show(show), labels)
        save_png(target, sheet, {"Software": "PARAVOL"})
    values = {
        name: float(volume.sample(place))
        for name, volume in read.volumes.items()
        if name in ("ct", "mr", "t1", "t2", "distance")
    }
    air = label_at(read, place)
    if json:
        nodes = transfer_of(read).nodes.tolist()
        here = {"at_mm": place.tolist(), "label": air, "values": values}
        quality = msgspec.to_builtins(read.record.quality)
        print_json({"file": str(target), **here, "nodes": nodes, "quality": quality})
    else:
        told = ", ".join(f"{name} {value:.1f}" for name, value in values.items())
        where = " ".join(f"{v:.1f}" for v in place)
        print(f"{target}: at {where} mm lies {air}; {told}")
        for line in quality_lines(read.record):
            print(f"scan: {line}")
    return 0


def quality_lines(record: "CaseRecord") -> list[str]:
    """Return a line for each finding on a scan: what was measured, what it limits."""
    return [
        f"{finding.told}. Limit: {finding.limits}" if finding.limits else finding.told
        for finding in record.quality
    ]
