from itertools import pairwise

import msgspec
import numpy as np
import pytest

from anatomy.phantom.ethmoid import CANAL_WALL_MM
from anatomy.phantom.fixed_shapes import SHAPES, course
from anatomy.phantom.parameters import SPHENOID_KINDS, PhantomParameters
from anatomy.phantom.phantom import build_phantom, distance_at
from anatomy.phantom.plates import skull_base
from anatomy.phantom.shapes import smooth_max
from anatomy.phantom.sphenoid import (
    pneumatization,
    rear_mm,
    septum,
    septum_end_mm,
    sphenoid,
    sphenoid_body,
    sphenoid_middle,
)
from anatomy.phantom.variants import with_variants
from anatomy.queries.hazards import hazard_distances
from anatomy.tissue import Label, Side
from benchmarks.phantom_figures.sinus_volumes import leaks, sinus_volumes_ml
from tests.slow_cases import slow

STRAIGHT = PhantomParameters(septal_deviation_mm=0.0)
BOX = ((-26.0, 26.0), (44.0, 90.0), (16.0, 54.0))
SIDES = (Side.RIGHT, Side.LEFT)
TUBES = ("optic nerve", "internal carotid", "vidian nerve", "maxillary nerve")


def places(count: int = 60_000) -> np.ndarray:
    """Give points u, y, z ``(3, n)`` about a sphenoid sinus."""
    rng = np.random.default_rng(3)
    return rng.uniform([0, -88, 18], [26, -50, 50], (count, 3)).T


def walls(parameters: PhantomParameters, names: tuple[str, ...]) -> dict[str, float]:
    """Measure the least distance of sphenoid and ethmoid air to each tube."""
    points = places() * np.array([[1.0], [-1.0], [1.0]])
    world = np.concatenate([points.T, points.T * (-1, 1, 1)])
    inside = world[distance_at(parameters, world) < 0]
    assert len(inside) > 5000
    found = hazard_distances(parameters, inside)
    sides = ("right", "left")
    return {f"{n}, {s}": float(found[f"{n}, {s}"].min()) for n in names for s in sides}


@pytest.mark.parametrize("seed", [1, 2, 5])
def test_every_canal_keeps_its_bone_and_mucosa(seed: int) -> None:
    head = msgspec.structs.replace(STRAIGHT, seed=seed, unevenness=1.5)
    head = with_variants(head, ["lateral-recess", "postsellar-sphenoid", "onodi"])
    for name, mm in walls(head, TUBES).items():
        assert mm >= CANAL_WALL_MM + head.mucosa_mm - 1e-3, name


def test_a_dehiscent_canal_has_mucosa_alone_on_its_side() -> None:
    head = with_variants(STRAIGHT, ["dehiscent-carotid:left"])
    found = walls(head, ("internal carotid",))
    mucosa = head.mucosa_mm
    assert mucosa <= found["internal carotid, left"] < mucosa + 0.15
    assert found["internal carotid, right"] >= mucosa + CANAL_WALL_MM - 1e-3


@pytest.mark.parametrize("name", ["internal carotid", "optic nerve"])
@pytest.mark.parametrize("kind", ["sellar", "postsellar"])
def test_carotid_and_optic_nerve_bulge_into_the_sinus(name: str, kind: str) -> None:
    """The body without them would be air at least 1 mm deeper."""
    head, tube = STRAIGHT, SHAPES[name]
    if kind != "sellar":
        head = with_variants(head, [f"{kind}-sphenoid"])
    points = places()
    wall = CANAL_WALL_MM + head.mucosa_mm
    body = sphenoid_body(head, Side.RIGHT)
    claimed = tube.evaluate(points) < wall
    assert -body.evaluate(points)[claimed].min() >= 1.0
    # and is air just before the bulge
    dented = sphenoid(head, Side.RIGHT).evaluate(points)
    skin = np.abs(tube.evaluate(points) - wall - 0.5) < 0.3
    assert np.count_nonzero(dented[skin] < 0) > 20


def test_between_the_bulges_is_a_recess() -> None:
    """At the recess the sinus reaches further to the side than at either bulge."""
    y = np.linspace(-76.0, -56.0, 81)
    z = np.linspace(33.0, 45.0, 49)
    u = np.linspace(4.0, 17.0, 261)
    grid = np.stack(np.meshgrid(u, y, z, indexing="ij")).reshape(3, -1)
    air = (sphenoid(STRAIGHT, Side.RIGHT).evaluate(grid) < 0).reshape(261, 81, 49)
    reach = u[np.where(air.any(0), 260 - air[::-1].argmax(0), 0)]
    recess = reach[np.argmin(abs(y + 62.5)), np.argmin(abs(z - 40.0))]
    carotid = reach[np.argmin(abs(y + 69.0)), np.argmin(abs(z - 36.0))]
    optic = reach[np.argmin(abs(y + 60.0)), np.argmin(abs(z - 43.5))]
    assert recess > carotid + 1.0
    assert recess > optic + 1.0


@pytest.mark.parametrize("scale", [0.7, 1.0, 1.15])
def test_kinds_end_where_they_are_named_after(scale: float) -> None:
    """The sella's walls are at 67 and 78 mm."""
    head = PhantomParameters(sphenoid_scale=scale)
    found = {"sellar": rear_mm(head, Side.RIGHT)}
    for name in SPHENOID_KINDS:
        one = with_variants(head, [f"{name}:left"])
        assert pneumatization(one, Side.RIGHT) == "sellar"
        assert pneumatization(one, Side.LEFT) == name.removesuffix("-sphenoid")
        found[pneumatization(one, Side.LEFT)] = rear_mm(one, Side.LEFT)
    assert found["conchal"] > -63.0
    assert -67.0 < found["presellar"] < -63.0
    assert -78.5 < found["sellar"] < -67.0
    assert -86.0 < found["postsellar"] < -79.5


@pytest.mark.parametrize("kind", ["postsellar", *slow("conchal", "presellar")])
def test_a_kind_changes_its_side_alone_and_drains(kind: str) -> None:
    head = with_variants(STRAIGHT, [f"{kind}-sphenoid:left"])
    plain, made = build_phantom(STRAIGHT, 1.0), build_phantom(head, 1.0)
    assert leaks(made, {"sphenoid": 3.2}) == []
    left, right = (
        sinus_volumes_ml(made, s)["sphenoid"] for s in (Side.LEFT, Side.RIGHT)
    )
    usual = [sinus_volumes_ml(plain, s)["sphenoid"] for s in (Side.LEFT, Side.RIGHT)]
    assert right == pytest.approx(usual[1], abs=0.01)
    if kind == "postsellar":
        assert left > usual[0] + 0.5
    else:
        assert left < usual[0] - 1.0


def test_a_recess_lies_beside_the_line_of_canal_and_foramen_on_its_side() -> None:
    head = with_variants(STRAIGHT, ["lateral-recess:left"])
    made = build_phantom(head, 0.7, field_mm=BOX)
    x = made.ct.origin_mm[0] + made.spacing_mm * np.arange(made.ct.shape[2])
    air = made.labels.values == Label.SPHENOID_AIR
    farthest = {s: float(np.max(s * x[air.any((0, 1))])) for s in (1.0, -1.0)}
    assert farthest[1.0] > 20.0
    assert farthest[-1.0] < 17.0


def test_the_roof_keeps_bone_under_planum_and_sella() -> None:
    points = places()
    for side in SIDES:
        inside = points[:, sphenoid(STRAIGHT, side).evaluate(points) < 0]
        above = skull_base(STRAIGHT).evaluate(inside) - inside[2]
        assert above.min() > 0.9


def test_in_a_third_of_heads_the_septum_ends_at_a_carotid() -> None:
    ends = np.array([septum_end_mm(PhantomParameters(seed=s)) for s in range(400)])
    carotid = np.abs(ends) >= 7.5
    assert 0.27 < carotid.mean() < 0.43
    assert np.abs(ends).max() <= 9.0
    assert 0.35 < (ends > 0).mean() < 0.65
    # and both sides see one plate
    for seed in range(12):
        head = PhantomParameters(seed=seed, septal_deviation_mm=0.0)
        both = smooth_max(0.0, sphenoid(head, Side.RIGHT))
        assert both.evaluate(np.array([[12.0], [-95.0], [34.0]]))[0] > 0


def test_the_septum_meets_the_roof_off_the_line_at_the_ostia() -> None:
    """At the ostia it is in the middle at any height; behind, the heads differ."""
    front = np.array([[0.0] * 2, [-54.0] * 2, [34.0, 44.0]])
    rear = np.array([[0.0] * 2, [-66.0] * 2, [34.0, 44.0]])
    leans = []
    for seed in range(60):
        head = PhantomParameters(seed=seed)
        faces = [septum(head, side).evaluate(rear) for side in SIDES]
        # Both sides see one plate, of even thickness.
        assert faces[0] + faces[1] == pytest.approx(2 * 0.85)
        assert np.ptp(septum(head, Side.RIGHT).evaluate(front)) < 0.15
        leans.append(faces[0][1] - faces[0][0])
    assert np.std(leans) > 1.0
    assert np.abs(leans).max() < 3.0


@pytest.mark.parametrize("seed", range(12))
def test_the_middle_is_air_in_every_kind(seed: int) -> None:
    for name in ("", *SPHENOID_KINDS):
        head = PhantomParameters(seed=seed, septal_deviation_mm=0.0)
        head = with_variants(head, [name] if name else [])
        for side in SIDES:
            at = np.array(sphenoid_middle(head, side)[0])[:, None]
            assert sphenoid(head, side).evaluate(at)[0] < -0.5, (name, side)


def test_foramen_and_canal_lie_as_published() -> None:
    """Rotundum 19 mm from the midline, the canal below and medial to it."""
    nerve, canal = (
        course(name).points for name in ("maxillary nerve", "pterygoid canal")
    )
    assert nerve[1][0] == pytest.approx(19.0, abs=2.1)
    assert canal[0][0] < nerve[1][0]
    assert canal[0][2] < nerve[1][2]
    length = sum(np.linalg.norm(np.subtract(a, b)) for a, b in pairwise(canal))
    assert length == pytest.approx(12.6, abs=2.6)
