"""An operated head as one frame showed it, whatever is cut out of it afterwards."""

from dataclasses import dataclass, field, replace

import numpy as np
from xxhash import xxh3_128

from renderers.scene import Scene
from renderers.snapshots.volume_changes import FrozenSurface, VolumeChanges
from surgery.patient import OperatedPatient
from surgery.pushing import Pushing


@dataclass(frozen=True, slots=True)
class OperatedHead:
    """What differs from the head before: a few kB a cut.

    surface: what the endoscope sees. ct: bricks of the CT. digest: 32 hexadecimal
    digits of all that differs; "" where nothing was cut and nothing bleeds.
    """

    surface: FrozenSurface
    ct: VolumeChanges | None
    digest: str = field(init=False)

    def __post_init__(self) -> None:
        digest, is_changed = xxh3_128(), False
        for part in (self.surface.distance, self.surface.film, self.ct):
            if part:
                is_changed = True
                digest.update(part.record().data)
            digest.update(b"|")
        if self.surface.bent:
            digest.update(self.surface.bent.record().data)
        for axis in self.surface.offsets or ():
            is_changed = True
            digest.update(b"|")
            digest.update(axis.record().data)
        object.__setattr__(self, "digest", digest.hexdigest() if is_changed else "")

    @classmethod
    def of(
        cls, patient: OperatedPatient, pushing: Pushing | None = None
    ) -> "OperatedHead":
        """Copy what differs; to be called by the thread that edits, between edits.

        pushing: how tools bend it; None where they do not.
        """
        boxes = [patient.touched, None if pushing is None else pushing.box]
        ends = [box for box in boxes if box is not None]
        box = np.zeros(3, np.int64), np.zeros(3, np.int64)
        if ends:
            # what is cut is shown elsewhere where it is bent, but within that box
            low, high = np.array(ends).transpose(1, 0, 2)
            box = low.min(axis=0), high.max(axis=0)
        shown = None if pushing is None else pushing.surface
        ct, before = patient.ct, patient.pristine_ct
        bricks = None
        if ct is not None and before is not None:
            bricks = VolumeChanges.between(before, ct.values, box)
        return cls(FrozenSurface.of(patient.surface, box, shown), bricks)

    def scene(self, before: Scene) -> Scene:
        """Return the whole scene of then, from that of the head before."""
        volume = before.volume
        if self.ct:
            volume = volume.with_values(
                self.ct.applied(volume.values), volume.background
            )
        return replace(before, volume=volume, surface=self.surface.thawed())
