"""What tracing a request finds, and what its rays are gathered in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.art.regions import Gather
from renderers.art.tracer import classic_image, scope_gbuffer
from renderers.scene import Camera, GBuffer, Image, Scene
from renderers.scene.composition import before_solids, solids_seen
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.request import ClassicWork, ScopeWork, SnapshotRequest

Tools = Sequence[PlacedMesh]


@dataclass(frozen=True, slots=True)
class Traced:
    """Hold what tracing found: a G-buffer in mode scope, an image in mode classic.

    The image has the request's instruments in it; they join the G-buffer later.
    drawn: ``(h, w)``, the rays that were traced; None for all. The others show what a
    coarser picture has there, each of whose rays stands for `coarse` along a side.
    step_voxels: of the steps taken; None where not all was traced.
    """

    found: GBuffer | Image
    counters: dict[str, int]
    drawn: NDArray[np.bool_] | None = None
    step_voxels: float | None = None
    coarse: int = 1


def traced_camera(request: SnapshotRequest) -> Camera:
    """Get the camera that is traced: 2 x 2 rays a pixel for 4 samples."""
    camera = request.to_camera()
    factor = 2 if request.image.samples == 4 else 1
    return camera.with_size(camera.width * factor, camera.height * factor)


def empty_gather(request: SnapshotRequest) -> Gather:
    """Make what a request's rays are gathered in."""
    camera = traced_camera(request)
    return Gather(camera.width, camera.height)


def ending_rays(request: SnapshotRequest, tools: Tools) -> GBuffer | None:
    """Draw what a request's rays end at: its instruments in mode classic.

    None where there are none, and in mode scope, whose rays end at the tissue. tools:
    the request's, as `load_tools` gives them; ValueError for others, so that nobody
    draws a picture without them.
    """
    work = request.work
    wanted = work.instruments if isinstance(work, ClassicWork) else ()
    if len(tools) != len(wanted):
        raise ValueError(
            f"the request places {len(wanted)} instruments that rays end at, and "
            f"{len(tools)} were loaded"
        )
    return solids_seen(traced_camera(request), tools) if wanted else None


def found_by(request: SnapshotRequest, scene: Scene, gather: Gather) -> GBuffer | Image:
    """Read gathered rays: a G-buffer in mode scope, an image in mode classic."""
    if isinstance(request.work, ScopeWork):
        assert scene.surface is not None
        return scope_gbuffer(gather, scene.surface.distance)
    return among_solids(classic_image(gather), request, scene, gather.solids)


def among_solids(
    image: Image, request: SnapshotRequest, scene: Scene, solids: GBuffer | None
) -> Image:
    """Put what rays ended at behind what they found before it."""
    if solids is None:
        return image
    return before_solids(image, scene, traced_camera(request), solids)
