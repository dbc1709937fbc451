"""Looks to begin with, for the densities of a scan."""

from collections.abc import Sequence

from anatomy.tissue import SURFACE_HU
from paravol.volume.look import LookPoint, VolumeLook
from paravol.volume.scan import Scan

BONE, MUCOSA, SKIN, AIRWAY = "#e8e0cf", "#c0615a", "#dfa98b", "#6db5c9"
BONE_HU = 300.0


def presets(scan: Scan) -> list[VolumeLook]:
    """Return looks for a scan, the most useful first.

    Those of a CT stand at its CT numbers; thin bone begins at 100 to 400 HU at clinical
    resolution. An MR has no fixed numbers: its looks stand at shares of its range.
    """
    return _of_ct() if scan.is_ct else _of_mr(scan)


def _of_ct() -> list[VolumeLook]:
    bone = ((60, BONE, 0.0), (140, BONE, 0.63), (500, BONE, 0.98), (1500, BONE, 1.0))
    mucosa = ((-600, MUCOSA, 0.0), (-300, MUCOSA, 0.98), (100, MUCOSA, 0.98))
    skin = ((-600, SKIN, 0.0), (-300, SKIN, 0.9), (150, SKIN, 0.9))
    airway = ((-900, AIRWAY, 0.0), (-750, AIRWAY, 0.18), (-500, AIRWAY, 0.18))
    glass = ((-600, SKIN, 0.0), (-400, SKIN, 0.02), (60, SKIN, 0.02))
    return [
        _look("Bone", bone, BONE_HU),
        _look("Bone under glass skin", (*glass, *bone[1:]), BONE_HU),
        _look(
            "Mucosa and bone",
            (*mucosa, (250, "#dfc8b0", 1.0), (700, BONE, 1.0)),
            SURFACE_HU,
        ),
        _look("Skin", (*skin, (400, BONE, 1.0)), SURFACE_HU),
        _look(
            "Walls of the airway",
            (*airway, (-250, AIRWAY, 0.0), (1500, AIRWAY, 0.0)),
            SURFACE_HU,
            threshold=0.02,
        ),
    ]


def _of_mr(scan: Scan) -> list[VolumeLook]:
    def at(share: float) -> float:
        return scan.low + share * (scan.high - scan.low)

    tissue = ((0.08, SKIN, 0.0), (0.2, SKIN, 0.6), (0.6, MUCOSA, 0.9))
    bright = ((0.5, MUCOSA, 0.0), (0.7, MUCOSA, 0.5), (0.95, "#f2e9d8", 0.95))
    return [
        _look("Tissue", [(at(s), c, o) for s, c, o in tissue], at(0.15)),
        _look("What is bright", [(at(s), c, o) for s, c, o in bright], at(0.65)),
    ]


def _look(
    name: str,
    points: Sequence[tuple[float, str, float]],
    surface: float,
    threshold: float = 0.1,
) -> VolumeLook:
    return VolumeLook(
        name, tuple(LookPoint(*point) for point in points), surface, threshold
    )
