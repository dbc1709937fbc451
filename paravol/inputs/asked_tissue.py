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
from scenarios.tasks import Task
from scenarios.tasks import task as tasks
from scenarios.tasks.head_parts import Head

Doubles = NDArray[np.float64]

ASKED, SPARED = 255, 254
"""Stand among labels for tissue that is asked for, and for what is to be spared."""

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


def labels_with_asked(patient: PatientScene, every: Sequence[Task]) -> Volume | None:
    """Return a head's labels; `ASKED` and `SPARED` where tasks say so.

    None where nobody knows what is where.
    """
    named = patient.structures
    if named is None:
        return None
    values = named.labels.values.astype(np.uint8)
    head = Head(patient.surface.distance, named)
    known = {label.name.lower().replace("_", " "): label.value for label in Label}
    for name in spared_by(every):
        values[named.labels.values == known.get(name, -1)] = SPARED
    for task in every:
        if isinstance(task, tasks.Remove):
            wanted = [n for n, limit in task.tissues.items() if limit.least_mm3 > 0.0]
            numbers = [known[name] for name in wanted if name in known]
            values[np.isin(named.labels.values, numbers)] = ASKED
            for name, share in task.parts.items():
                part = head.part(name) if share.least_percent > 0.0 else None
                if part is not None:
                    values.reshape(-1)[part.voxels] = ASKED
        elif isinstance(task, tasks.Open):
            _mark_way(task, patient, named.labels, values)
    return named.labels.with_values(values, 0)


def _mark_way(
    task: tasks.Open, patient: PatientScene, labels: Volume, values: NDArray[np.uint8]
) -> None:
    """Mark the tissue about a way that is to be opened."""
    ends = [
        patient.landmarks[place] if isinstance(place, str) else np.array(place)
        for place in (task.start, task.end)
    ]
    places = around_way(task, *ends)
    matrix = labels.voxel_from_world
    i, j, k = np.rint(places @ matrix[:3, :3].T + matrix[:3, 3]).astype(int).T
    nz, ny, nx = labels.shape
    inside = (i >= 0) & (i < nx) & (j >= 0) & (j < ny) & (k >= 0) & (k < nz)
    values[k[inside], j[inside], i[inside]] = ASKED


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
