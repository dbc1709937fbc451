"""What an exercise asks to be taken, voxel by voxel: a hand that is pointed near it
means it.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from anatomy.tissue import Label
from paravol.patient import PatientScene
from renderers.scene import Volume
from scenarios.structures import Structures
from scenarios.tasks import Task
from scenarios.tasks import task as tasks
from scenarios.tasks.head_parts import Head

Doubles = NDArray[np.float64]
Voxels = NDArray[np.intp]

_NONE = np.zeros(0, np.intp)

ASKED, SPARED, LATER = 255, 254, 253
"""Stand among labels for tissue that the open task asks for, for what is to be spared,
and for what other tasks ask for."""

STEP_MM = 0.4
"""Between places of a way that is to be opened."""


def spared_by(every: Sequence[Task]) -> tuple[str, ...]:
    """Return the names of tissues of which tasks allow only so much to be taken."""
    removes = [task for task in every if isinstance(task, tasks.Remove)]
    named = {
        name
        for task in removes
        for name, limit in task.tissues.items()
        if limit.most_mm3 is not None and not limit.least_mm3
    }
    return tuple(sorted(named))


class AskedTissue:
    """A head's labels, in which what the task asks for is marked.

    labels: of the head, with `ASKED` for what the open task asks, `LATER` for what
    others do, and `SPARED`.
    """

    def __init__(
        self, patient: PatientScene, named: Structures, every: Sequence[Task]
    ) -> None:
        """Mark what all tasks ask for, as if all were open."""
        values = named.labels.values.astype(np.uint8)
        known = {label.name.lower().replace("_", " "): label.value for label in Label}
        for name in spared_by(every):
            values[named.labels.values == known.get(name, -1)] = SPARED
        self._values = values.reshape(-1)
        self._each: dict[str, Voxels] = {}
        head = Head(patient.surface.distance, named)
        for task in every:
            if isinstance(task, tasks.Remove):
                asks = [n for n, limit in task.tissues.items() if limit.least_mm3 > 0.0]
                numbers = [known[name] for name in asks if name in known]
                found = [np.flatnonzero(np.isin(named.labels.values, numbers))]
                for name, share in task.parts.items():
                    part = head.part(name) if share.least_percent > 0.0 else None
                    if part is not None:
                        found.append(part.voxels)
            elif isinstance(task, tasks.Open):
                found = [_on_way(task, patient, named.labels)]
            else:
                continue
            voxels = np.unique(np.concatenate(found))
            # a wall that two share may be one to be spared, as the plate to the orbit
            voxels = voxels[self._values[voxels] != SPARED]
            if len(voxels):
                self._each[task.name] = voxels
        self._all = np.unique(np.concatenate([*self._each.values(), _NONE]))
        self.labels = named.labels.with_values(values, 0)
        self._task: str | None = None
        self._values[self._all] = ASKED

    def ask(self, task: str | None) -> None:
        """Mark what one task asks for; of others, or for None, all."""
        if task == self._task:
            return
        self._task = task
        self._values[self._all] = LATER
        self._values[self._each.get(task or "", self._all)] = ASKED


def asked_tissue(patient: PatientScene, every: Sequence[Task]) -> AskedTissue | None:
    """Mark what tasks ask for in a head; None where nobody knows what is where."""
    named = patient.structures
    return None if named is None else AskedTissue(patient, named, every)


def _on_way(task: tasks.Open, patient: PatientScene, labels: Volume) -> Voxels:
    """Return the voxels about a way that is to be opened."""
    ends = [
        patient.landmarks[place] if isinstance(place, str) else np.array(place)
        for place in (task.start, task.end)
    ]
    places = around_way(task, *ends)
    matrix = labels.voxel_from_world
    i, j, k = np.rint(places @ matrix[:3, :3].T + matrix[:3, 3]).astype(int).T
    nz, ny, nx = labels.shape
    inside = (i >= 0) & (i < nx) & (j >= 0) & (j < ny) & (k >= 0) & (k < nz)
    found: Voxels = ((k * ny + j) * nx + i)[inside]
    return found


def around_way(task: tasks.Open, start: Doubles, end: Doubles) -> Doubles:
    """Return places ``(n, 3)`` within what a task opens, from its start to its end."""
    count = int(np.linalg.norm(end - start) / STEP_MM) + 2
    wide_mm = max(task.radius_mm, math.sqrt(task.area_mm2 / math.pi)) + 1.0
    steps = np.arange(-wide_mm, wide_mm + STEP_MM, STEP_MM)
    off = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    off = off[np.linalg.norm(off, axis=1) <= wide_mm]
    places = (np.linspace(start, end, count)[:, None] + off).reshape(-1, 3)
    # each once: balls about the way overlap
    found: Doubles = np.unique(np.round(places / STEP_MM), axis=0) * STEP_MM
    return found
