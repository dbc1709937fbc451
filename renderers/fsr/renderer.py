"""The Fuzzy-Set Renderer: a scene and a camera become a picture, without a window."""

from functools import cached_property

from renderers.fsr.classic import SplatMode, SplatRasterizer
from renderers.fsr.fuzzy_set import FuzzySet, Inclusion, extract_fuzzy_set
from renderers.fsr.scope import SurfelRasterizer
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import Camera, GBuffer, Image, Scene

BOUNDARY_THRESHOLD = 0.1
"""Default threshold: boundary opacity a splat needs to be worth drawing."""

BOUNDARY_SLOPE_SHARE = 0.25
"""Default boundary slope: this share of the transfer function's density range per
mm. A tissue-air edge spreads its 1000 HU over about one millimetre."""


class FuzzySetRenderer:
    """Splat a scene in mode `classic` or find its air surface for mode `scope`.

    The sets are extracted once, when first needed. Pictures are made one at a time;
    rows of each are shared out over `threads` threads, with the same bits for any
    number of them.

    scene: what is to be seen. inclusion, threshold: which voxels mode `classic`
        splats; by default opaque boundaries. points: splats of constant opacity in
        mode `classic`. Raises ValueError for a thread count below one.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        inclusion: Inclusion | None = None,
        threshold: float = BOUNDARY_THRESHOLD,
        threads: int = 2,
        points: bool = False,
    ) -> None:
        self.scene = scene
        self.points = points
        self._inclusion = inclusion or default_inclusion(scene)
        self._threshold = threshold
        self._team = ThreadTeam(threads)
        self._counters: dict[str, int] = {}

    @cached_property
    def fuzzy_set(self) -> FuzzySet:
        """Get the splats of mode `classic`."""
        return extract_fuzzy_set(self.scene.volume, self._inclusion, self._threshold)

    @property
    def counters(self) -> dict[str, int]:
        """Get what the last picture took: splats, rows, fragments."""
        return dict(self._counters)

    @property
    def splat_count(self) -> int:
        """Get the number of elements extracted so far, over all sets."""
        count = 0
        if "fuzzy_set" in self.__dict__:
            count += len(self.fuzzy_set)
        if "_scope" in self.__dict__:
            count += self._scope.splat_count
        return count

    def render(self, camera: Camera) -> Image:
        """Draw mode `classic`: premultiplied linear RGBA."""
        mode = SplatMode.POINTS if self.points else SplatMode.GAUSSIAN
        image = self._classic.draw(camera, self._team, mode)
        self._counters = {"splats": len(self.fuzzy_set), **self._classic.counters}
        return image

    def gbuffer(self, camera: Camera) -> GBuffer:
        """Find the air surface behind each pixel: the geometry of mode `scope`.

        Raises ValueError when the scene has no air surface or the camera is
        orthographic.
        """
        result = self._scope.draw(camera, self._team)
        self._counters = {"splats": self._scope.splat_count, **self._scope.counters}
        return result

    def close(self) -> None:
        """End the rendering threads; the renderer draws nothing afterwards."""
        self._team.close()

    @cached_property
    def _classic(self) -> SplatRasterizer:
        return SplatRasterizer(self.fuzzy_set, self.scene)

    @cached_property
    def _scope(self) -> SurfelRasterizer:
        if self.scene.surface is None:
            raise ValueError(
                "this scene has no air surface; give it one or draw mode classic"
            )
        return SurfelRasterizer(self.scene.surface.distance)


def default_inclusion(scene: Scene) -> Inclusion:
    """Choose opaque boundaries, by the scene's transfer function and spacing."""
    nodes = scene.transfer_function.nodes
    slope = BOUNDARY_SLOPE_SHARE * float(nodes[-1] - nodes[0])
    length_mm = float(scene.volume.spacing_mm.min())
    return Inclusion.boundary(scene.transfer_function, length_mm, slope)
