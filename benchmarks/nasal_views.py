"""Where the live picture is judged: named views of the default nose, and its flight."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from anatomy import PhantomParameters, classic_transfer_function, sinus_phantom
from anatomy.frame import lps_from_ras
from devices import ProbePath, load_probe_path
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.scene import AirSurface, Camera, GBuffer, Scene, rmse_codes, ssim
from renderers.shading import CameraPass, ScopeLight, ScopeShader, Tier, scope_picture
from scenarios import Endoscope, Scenario, load_scenario, tip_frame

Picture = NDArray[np.uint8]

FIELD_OF_VIEW_DEG = 88.0
"""Of a rigid sinus scope: measured half angles are 38 to 47 degrees."""

THICK_MM, THIN_MM = 4.0, 2.7
"""Outer diameters of the two scopes in use."""

CUT_VOXELS = 2.0
"""Surfaces this near to a side of the grid belong to the cut through the head there,
which the ray tracer draws and surfels do not."""

OPENING_MM = 2.0
"""What lies this much deeper than its rim is seen through an opening."""

SAME_WALL_MM = 0.5
"""Depths that differ by less are of one wall."""

WIDEST_SHARE = 1 / 8
"""Of a picture's width: wider openings are passages, which no disc closes."""

LEAST_SHARE = 1.5e-4
"""Of a picture's pixels: an opening of fewer is not counted."""

RIM_SHARE = 0.75
"""Of the pixels around an opening that must be about as near as its ground."""

OPEN_SHARE = 0.25
"""Of an opening's pixels that must stay deep for it to be open."""


@dataclass(frozen=True, slots=True)
class NasalView:
    """Name a place of the scope in a nose.

    head: "default", or "operated": without the right uncinate process.
    """

    name: str
    head: str
    camera: Camera
    light: ScopeLight


@dataclass(frozen=True, slots=True)
class ViewAgreement:
    """How the splatted picture of a view differs from the ray-traced one.

    ssim, rmse_codes: of the encoded pictures, gain and grain alike. holes: pixels with
    a wall that the splats leave empty. openings: how many the ray tracer looks
    through. closed: how many of them the splats close. normal_deg: mean angle between
    normals where both hit the same wall.
    """

    ssim: float
    rmse_codes: float
    holes: int
    openings: int
    closed: int
    normal_deg: float


# name, head, eye and target in RAS mm (left of the patient negative), diameter and
# angle of the scope, turn of its light post
_VIEWS = (
    ("vestibule", "default", (6.4, 13, -9.5), (6, -6, 8.5), THICK_MM, 0, 0),
    ("turbinate", "default", (5.3, 1.5, 10.5), (6.2, -30, 7.5), THICK_MM, 0, 0),
    ("middle meatus", "default", (5, -4, 17.5), (6.8, -28, 24.5), THICK_MM, 0, 0),
    ("recess", "default", (3.2, -43, 26), (3.8, -54, 35), THIN_MM, 0, 0),
    ("choana", "default", (4.6, -46, 7.5), (6.5, -70, 7.5), THICK_MM, 0, 0),
    ("ostium", "operated", (8.6, -20.5, 22.5), (9, -35, 22), THIN_MM, 30, -95),
)  # fmt: skip


def acceptance_views(size: int) -> list[NasalView]:
    """Return the six views in which a surgeon should know where he is."""
    views = []
    for name, head, eye, target, diameter_mm, angle_deg, roll_deg in _VIEWS:
        eye_mm, target_mm = lps_from_ras(np.array([eye, target], np.float64))
        light = ScopeLight.for_diameter(diameter_mm)
        scope = Endoscope(
            diameter_mm,
            angle_deg,
            FIELD_OF_VIEW_DEG,
            ring_radius_mm=light.ring_radius_mm,
        )
        tip = tip_frame(eye_mm, target_mm - eye_mm)
        camera = scope.camera(tip, roll_deg, (size, size))
        views.append(NasalView(name, head, camera, light))
    return views


@cache
def bundled_flight() -> tuple[Scenario, ProbePath]:
    """Return the scenario that the demonstration flies, and its path."""
    scenario, folder = load_scenario("first_flight")
    return scenario, load_probe_path(folder / scenario.path)


def path_views(size: int, count: int) -> list[NasalView]:
    """Return views in the middle of `count` equal parts of the bundled flight."""
    scenario, path = bundled_flight()
    scope = scenario.scope.endoscope()
    light = ScopeLight(scenario.scope.ring_radius_mm)
    views = []
    for part in range(count):
        at_s = (part + 0.5) * path.duration_s / count
        state = path.sample(at_s)
        tip = tip_frame(state.tip_mm, state.axis)
        camera = scope.camera(tip, state.roll_deg, (size, size))
        views.append(NasalView(f"flight at {at_s:.3g} s", "default", camera, light))
    return views


@cache
def nasal_scene(head: str) -> Scene:
    """Build a head of `NasalView.head` at the flight's spacing."""
    scenario, _ = bundled_flight()
    parameters = PhantomParameters(
        seed=scenario.head.seed, uncinectomy=head == "operated"
    )
    phantom = sinus_phantom(parameters, spacing_mm=scenario.head.spacing_mm)
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    return Scene(phantom.ct, classic_transfer_function(), surface=surface)


class Judge:
    """Compare splatted pictures of a head with ray-traced ones, shaded alike."""

    def __init__(self, head: str, tier: Tier = Tier.LIVE, threads: int = 2) -> None:
        self.scene = nasal_scene(head)
        surface = self.scene.surface
        assert surface is not None
        self._distance = surface.distance
        self._tracer = ActiveRayTracer(self.scene, threads=threads)
        self._splats = FuzzySetRenderer(self.scene, threads=threads)
        self._shader = ScopeShader(surface, tier, threads=threads)
        self._camera_pass = CameraPass(threads=threads)

    def compare(self, view: NasalView) -> tuple[ViewAgreement, Picture, Picture]:
        """Return the agreement, the splatted picture and the ray-traced one."""
        truth = self._tracer.gbuffer(view.camera)
        found = self._splats.gbuffer(view.camera)
        traced, gain = self._finish(view, truth, None)
        splatted, _ = self._finish(view, found, gain)
        cut = self._is_cut(view.camera, truth)
        for picture in (traced, splatted):
            picture[cut] = 0
        met = (truth.coverage > 0) & ~cut
        both = met & (found.coverage > 0)
        apart = np.abs(found.depth_mm[both] - truth.depth_mm[both])
        both[both] = apart < SAME_WALL_MM
        cosine = np.sum(found.normal[both] * truth.normal[both], axis=-1)
        openings, closed = count_openings(truth.depth_mm, found.depth_mm, met)
        agreement = ViewAgreement(
            ssim(splatted, traced),
            rmse_codes(splatted, traced),
            int(np.count_nonzero(met & (found.coverage == 0))),
            openings,
            closed,
            float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean()),
        )
        return agreement, splatted, traced

    def close(self) -> None:
        """End the threads."""
        self._splats.close()
        self._shader.close()
        self._camera_pass.close()

    def _finish(
        self, view: NasalView, buffer: GBuffer, gain: float | None
    ) -> tuple[Picture, float]:
        return scope_picture(
            buffer, view.camera, self._shader, self._camera_pass, view.light, gain
        )

    def _is_cut(self, camera: Camera, buffer: GBuffer) -> NDArray[np.bool_]:
        """Tell where a G-buffer shows a side of the grid, or nothing."""
        met = buffer.coverage > 0
        origin, ray = camera.rays()
        depth = np.where(met, buffer.depth_mm, 0.0)
        points = origin + depth[..., None] * ray
        m = self._distance.voxel_from_world
        voxels = points @ m[:3, :3].T + m[:3, 3]
        last = np.array(self._distance.shape[::-1]) - 1
        gap = np.minimum(voxels, last - voxels).min(axis=-1)
        return np.asarray(~met | (gap < CUT_VOXELS), np.bool_)


def count_openings(
    truth_mm: NDArray[np.float32], found_mm: NDArray[np.float32], met: NDArray[np.bool_]
) -> tuple[int, int]:
    """Count the small openings in a depth picture, and those that another one closes.

    met: pixels that count. An opening is a patch of pixels deeper by `OPENING_MM` than
    what a square of `WIDEST_SHARE` of the picture's width finds around it, with a rim
    on most sides: a corner of a passage has none towards the passage.
    """
    from scipy.ndimage import binary_dilation, grey_opening, label

    side = max(3, round(WIDEST_SHARE * met.shape[1]))
    depth = np.where(met, truth_mm, 0.0)
    ground = grey_opening(depth, size=(side, side))
    patches, count = label(met & (depth > ground + OPENING_MM))
    is_deep = found_mm > ground + OPENING_MM / 2
    openings = closed = 0
    for patch in range(1, count + 1):
        within = patches == patch
        if within.sum() < LEAST_SHARE * met.size:
            continue
        rim = binary_dilation(within) & ~within
        if np.mean(depth[rim] < np.median(ground[within]) + OPENING_MM) < RIM_SHARE:
            continue
        openings += 1
        closed += bool(is_deep[within].mean() < OPEN_SHARE)
    return openings, closed
