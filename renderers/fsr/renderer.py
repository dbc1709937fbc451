"""The Fuzzy-Set Renderer: a scene and a camera become a picture, without a window."""

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.fuzzy_set import (
    BOUNDARY_THRESHOLD,
    FuzzySet,
    Inclusion,
    default_inclusion,
    extract_fuzzy_set,
    update_fuzzy_set,
)
from renderers.fsr.splats import SplatMode, SplatRasterizer, Traversal
from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.surfels.crease_tracing import CreaseTracer
from renderers.fsr.visibility import VisibleSets
from renderers.fsr.visibility.visible_set_store import stored_visible_sets
from renderers.fsr.visibility.visible_sets import Progress
from renderers.scene import Camera, Change, ChangeKind, GBuffer, Image, Scene
from renderers.scene.composition import before_solids
from renderers.scene.deflection import Deflection, deflected_scene
from renderers.scene.thread_pool import ThreadPool


class FuzzySetRenderer:
    """Splat a scene in mode `classic` or find its air surface for mode `scope`.

    The sets are extracted once, when first needed. Pictures are made one at a time;
    rows of each are shared out over `threads` threads, or over a pool's that others
    use as well, with the same bits for any number of them.

    scene: what is to be seen. inclusion, threshold: which voxels mode `classic`
        splats; by default opaque boundaries. mode: how it draws them. traversal: in
        which order. deflection: moves the tissue: in mode
        `scope` splat by splat, in mode `classic` voxel by voxel, before splats are
        chosen. Raises ValueError for a thread count below one, or what is no mode.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        inclusion: Inclusion | None = None,
        threshold: float = BOUNDARY_THRESHOLD,
        threads: int | ThreadPool = 2,
        mode: SplatMode = SplatMode.GAUSSIAN,
        traversal: Traversal = Traversal.DISTANCE,
        deflection: Deflection | None = None,
    ) -> None:
        self.scene = deflected_scene(scene, deflection) if deflection else scene
        self._undeformed = scene.surface
        self._deflection = deflection
        self.mode = SplatMode(mode)
        self.traversal = traversal
        self._inclusion = inclusion or default_inclusion(scene)
        self._threshold = threshold
        self._pool = ThreadPool.of(threads)
        self._count: Callable[[], dict[str, int]] = dict

    @cached_property
    def fuzzy_set(self) -> FuzzySet:
        """Return the splats of mode `classic`."""
        return extract_fuzzy_set(self.scene.volume, self._inclusion, self._threshold)

    @property
    def threshold(self) -> float:
        """Return what F must reach for a voxel to be splatted; may be set anew."""
        return self._threshold

    @threshold.setter
    def threshold(self, value: float) -> None:
        self._threshold = value
        for name in ("fuzzy_set", "_classic"):
            self.__dict__.pop(name, None)

    @property
    def counters(self) -> dict[str, int]:
        """Return what the last picture took: splats, rows, fragments."""
        return self._count()

    @property
    def splat_count(self) -> int:
        """Return the number of elements extracted so far, over all sets."""
        count = 0
        if "fuzzy_set" in self.__dict__:
            count += len(self.fuzzy_set)
        if "_scope" in self.__dict__:
            count += self._scope.splat_count
        return count

    def render(
        self,
        camera: Camera,
        *,
        with_depth: bool = False,
        limit_mm: NDArray[np.float32] | None = None,
    ) -> Image:
        """Draw mode `classic`: premultiplied linear RGBA.

        with_depth, limit_mm: see `SplatRasterizer.draw`. Raises ValueError for a
        distorted lens.
        """
        _refuse_distortion(camera)
        image = self._classic.draw(
            camera,
            self._pool,
            self.mode,
            self.traversal,
            with_depth=with_depth,
            limit_mm=limit_mm,
        )
        self._count = self._count_classic
        return image

    def film(self, cameras: Iterable[Camera]) -> Iterator[Image]:
        """Draw mode `classic` view by view, culling each while another is drawn.

        The pictures of `render`, to the bit; cameras are taken one ahead.
        """
        views = ((_refuse_distortion(camera), self.mode) for camera in cameras)
        for image in self._classic.film(views, self._pool, self.traversal):
            self._count = self._count_classic
            yield image

    def gbuffer(self, camera: Camera) -> GBuffer:
        """Find the air surface behind each pixel: the geometry of mode `scope`.

        Raises ValueError when the scene has no air surface, or the camera is
        orthographic or distorted.
        """
        _refuse_distortion(camera)
        result = self._scope.draw(camera, self._pool)
        self._count = self._count_scope
        return result

    def use_visible_sets(
        self, folder: Path | None = None, progress: Progress | None = None
    ) -> VisibleSets:
        """Find or read the patient's potentially visible sets, and use them.

        `gbuffer` then looks up which blocks an eye inside the airway may see in place
        of tracing cones. The pictures are the same; at 0.5 mm a frame takes 4 % less
        time and the sets 17 s, once for a patient. See `stored_visible_sets`.
        """
        scope = self._scope
        assert self.scene.surface is not None
        sets = stored_visible_sets(
            self.scene.surface.distance,
            scope.bounds(),
            self._pool,
            folder=folder,
            progress=progress,
        )
        scope.use_visible_sets(sets)
        return sets

    def update(self, change: Change) -> None:
        """Follow an edit of the scene's arrays in place.

        Sets extracted so far are brought up to date where the change reaches, and
        pictures equal those of a new renderer, to the bit. In mode `classic` they
        follow cuts, which the volume shows in the same voxels. Raises ValueError where
        a deflection moves the tissue: that is a copy of the scene.
        """
        if self._deflection is not None:
            raise ValueError(
                "a renderer with a deflection shows a copy of the scene, which no edit "
                "reaches; make a new one"
            )
        if "_scope" in self.__dict__:
            self._scope.update(change)
        if "fuzzy_set" in self.__dict__ and change.kind is ChangeKind.CUT:
            low, high = (
                np.clip(at, 0, self.scene.volume.shape[::-1]).tolist()
                for at in (change.low, change.high + 1)
            )
            self.__dict__["fuzzy_set"] = update_fuzzy_set(
                self.fuzzy_set,
                self.scene.volume,
                self._inclusion,
                self._threshold,
                (low[2], low[1], low[0]),
                (high[2], high[1], high[0]),
            )
            self.__dict__.pop("_classic", None)

    def close(self) -> None:
        """End the rendering threads; the renderer draws nothing afterwards."""
        self._pool.close()

    def _count_classic(self) -> dict[str, int]:
        return {"splats": len(self.fuzzy_set), **self._classic.counters}

    def _count_scope(self) -> dict[str, int]:
        return {"splats": self._scope.splat_count, **self._scope.counters}

    @cached_property
    def _classic(self) -> SplatRasterizer:
        return SplatRasterizer(self.fuzzy_set, self.scene)

    @cached_property
    def _scope(self) -> SurfelRasterizer:
        if self._undeformed is None:
            raise ValueError(
                "this scene has no air surface; give it one or draw mode classic"
            )
        creases = None
        if self._undeformed.wounds is not None and self._deflection is None:
            creases = CreaseTracer(self._undeformed)
        return SurfelRasterizer(
            self._undeformed.distance, deflection=self._deflection, creases=creases
        )


def render_among(renderer: FuzzySetRenderer, camera: Camera, solids: GBuffer) -> Image:
    """Draw mode `classic` with opaque solids in it: linear RGBA and depth.

    solids: what the camera sees of them alone, as `Mesh.gbuffer` gives it. Splats
    behind a solid are left out at that pixel, those before it cover it by what they
    absorb. The depth is the nearer of the solid's and the one where half the light is
    gone. Raises ValueError where the buffer does not fit the camera.
    """
    image = renderer.render(camera, with_depth=True, limit_mm=solids.depth_mm)
    return before_solids(image, renderer.scene, camera, solids)


def _refuse_distortion(camera: Camera) -> Camera:
    """Raise ValueError for a distorted lens: footprints follow the undistorted laws."""
    if not camera.distortion.is_none:
        raise ValueError(
            f"splats are drawn without distortion, got {camera.distortion}; take the "
            "ray tracer for this lens"
        )
    return camera
