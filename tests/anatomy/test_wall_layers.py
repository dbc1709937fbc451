"""Walls of the airway, layer by layer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.plates import (
    CRIBRIFORM_MM,
    FOVEA_MM,
    LAMINA_SHARE,
    LATERAL_LAMELLA_MM,
)
from anatomy.redistance import FARTHEST_MM
from anatomy.tissue import TISSUE_OF, Label
from anatomy.wall_layers import Layer, WallKind, WallLayers, layer_at
from renderers.scene import Volume
from tests.anatomy.layer_reference import layer_volumes

ETHMOID = ((-24.0, 24.0), (4.0, 62.0), (16.0, 60.0))


@pytest.fixture(scope="module")
def head() -> Phantom:
    return build_phantom(PhantomParameters(), 0.5, field_mm=ETHMOID)


def slab(kind: WallKind, ground: int, air_mm: float) -> tuple[WallLayers, Volume]:
    """Build a plane wall below z = air_mm in a box of 12 mm."""
    z = 0.5 * np.arange(25)
    depth = np.broadcast_to((z - air_mm)[:, None, None], (25, 25, 25))
    grid = Volume(depth.astype(np.float32), np.full(3, 0.5), np.zeros(3))
    wall = grid.with_values(np.ones(depth.shape, np.uint8), 0.0)
    below = grid.with_values(np.full(depth.shape, ground, np.uint8), 0.0)
    none = WallKind("", 0.0, 0.0, 0, 0)
    return WallLayers(wall, below, (none, kind)), grid


@given(
    st.floats(0.1, 2.0),
    st.floats(0.0, 2.0),
    st.floats(2.0, 5.0),
    st.tuples(*(st.floats(0.1, 11.9) for _ in range(3))),
)
def test_depth_alone_picks_the_layer(
    mucosa: float, bone: float, air: float, place: tuple[float, float, float]
) -> None:
    kind = WallKind("x", mucosa, bone, int(Label.MUCOSA), int(Label.FOVEA))
    layers, distance = slab(kind, int(Label.FAT), air)
    found = layer_at(layers, distance, np.array(place))
    depth = place[2] - air
    assert found.depth_mm == pytest.approx(depth, abs=1e-5)
    edges = np.array([0.0, mucosa, mucosa + bone])
    if np.abs(depth - edges).min() > 1e-4:
        layer = int(np.count_nonzero(depth > edges))
        assert found.layer == layer
        labels = (0, Label.MUCOSA, Label.FOVEA, Label.FAT)
        assert found.label == labels[layer]
    assert found.wall == 1


def test_every_named_wall_is_there_with_its_own_numbers(head: Phantom) -> None:
    thickness: dict[str, set[float]] = {}
    behind: dict[str, set[str]] = {}
    for kind in head.layers.kinds:
        thickness.setdefault(kind.name, set()).add(kind.bone_mm)
        behind.setdefault(kind.name, set()).add(kind.behind)
    cell = head.parameters.cell_bone_mm
    assert LAMINA_SHARE * cell in thickness["lamina papyracea"]
    assert FOVEA_MM in thickness["fovea ethmoidalis"]
    assert thickness["cribriform plate"] == {CRIBRIFORM_MM}
    assert thickness["lateral lamella"] == {LATERAL_LAMELLA_MM}
    assert thickness["basal lamella"] == {cell}
    assert thickness["ethmoid septum"] == {cell}
    assert {"uncinate process", "turbinate bone", "septal bone"} < thickness.keys()
    assert behind["lamina papyracea"] == {"orbit"}
    for roof in ("fovea ethmoidalis", "cribriform plate", "lateral lamella"):
        assert behind[roof] == {"skull base"}
    assert {"optic nerve", "internal carotid"} >= behind["sphenoid wall"] - {
        "",
        "skull base",
    }
    for kind in head.layers.kinds:
        if kind.name in ("lamina papyracea", "fovea ethmoidalis", "ethmoid septum"):
            assert kind.fracture_n == TISSUE_OF[Label(kind.bone)].fracture_n > 0


def test_walls_reach_as_deep_as_the_distance_is_known(head: Phantom) -> None:
    depth = head.distance.values
    near = (depth > 0) & (depth < FARTHEST_MM - 0.5)
    assert np.mean(head.layers.wall.values[near] > 0) > 0.999


def through(
    head: Phantom, way: np.ndarray, hazard: str, count: int
) -> tuple[list[list[str]], list[np.float64]]:
    """Follow rays out of ethmoid cells; list the layers up to a hazard, by name."""
    depth, labels = head.distance.values, head.labels.values
    cells = (Label.ANTERIOR_ETHMOID_AIR, Label.POSTERIOR_ETHMOID_AIR)
    air = np.argwhere(np.isin(labels, cells) & (depth < -0.6) & (depth > -3.0))
    places = air[:, ::-1] * 0.5 + head.ct.origin_mm
    # farther in front the frontal recess runs through thick bone
    places = places[(places[:, 1] > 19.0) & (places[:, 1] < 50.0)]
    chosen = np.random.default_rng(5).permutation(len(places))[:count]
    places = places[chosen]
    toward = np.where(way[0] != 0, np.sign(places[:, :1]), 1.0) * way
    t = np.arange(0.0, 9.0, 0.02)
    line = places[:, None, :] + t[None, :, None] * toward[:, None, :]
    to_hazard = head.hazards.distance_mm(hazard, line)
    found = layer_at(head.layers, head.distance, line)
    seen, thick = [], []
    for i in range(len(places)):
        reached = np.flatnonzero(to_hazard[i] < 0)
        if not len(reached):
            continue
        end = reached[0]
        open_ = np.flatnonzero(found.layer[i, :end] == Layer.AIR)
        start = open_[-1] + 1
        last = np.rint((line[i, start - 1] - head.ct.origin_mm) / 0.5).astype(int)
        if labels[tuple(last[::-1])] not in cells:
            continue
        names: list[str] = []
        for layer, row in zip(
            found.layer[i, start : end + 1], found.wall[i, start : end + 1], strict=True
        ):
            name = Layer(layer).name.lower()
            if layer == Layer.BONE:
                name = head.layers.kinds[row].name
            if not names or names[-1] != name:
                names.append(name)
        seen.append(names)
        thick.append(0.02 * np.count_nonzero(found.layer[i, start:end] == Layer.BONE))
    return seen, thick


@pytest.mark.parametrize(
    ("way", "hazard", "plate", "least"),
    [
        ((1.0, 0.0, 0.0), "orbit", "lamina papyracea", 0.95),
        ((0.0, 0.0, 1.0), "skull base", "fovea ethmoidalis", 0.95),
    ],
)
def test_from_a_cell_to_a_hazard_the_way_is_mucosa_plate_ground(
    head: Phantom, way: tuple[float, ...], hazard: str, plate: str, least: float
) -> None:
    seen, thick = through(head, np.array(way), hazard, 2500)
    assert len(seen) > 200
    assert np.mean([plate in names for names in seen]) >= least
    right = [names[:2] == ["mucosa", plate] for names in seen]
    assert np.mean(right) >= least
    lamina = LAMINA_SHARE * head.parameters.cell_bone_mm
    own = FOVEA_MM if hazard == "skull base" else lamina
    assert np.median(thick) == pytest.approx(own, rel=0.1)


def test_a_wall_between_two_airs_is_the_same_from_either_side() -> None:
    """The depth is to the nearest air, so layers mirror about the middle.

    A plate as thick as both halves together is met once: from one side up to the
    middle, from the other the rest.
    """
    mucosa, bone = 0.4, 0.25
    total = 2 * mucosa + bone
    kind = WallKind("septum", mucosa, bone, int(Label.MUCOSA), 23)
    x = 0.05 * np.arange(121) - 3.0
    depth = np.minimum(x + total / 2, total / 2 - x)
    grid = np.broadcast_to(depth.astype(np.float32), (4, 4, len(x)))
    distance = Volume(grid, np.full(3, 0.05), np.zeros(3))
    wall = distance.with_values(np.ones(distance.shape, np.uint8), 0.0)
    layers = WallLayers(wall, wall, (WallKind("", 0, 0, 0, 0), kind))
    t = 0.0025 + 0.005 * np.arange(1199)
    line = np.stack([t, np.full_like(t, 0.1), np.full_like(t, 0.1)], axis=1)
    found = layer_at(layers, distance, line)
    thick = [0.005 * np.count_nonzero(found.layer == layer) for layer in Layer]
    assert thick[Layer.MUCOSA] == pytest.approx(2 * mucosa, abs=0.011)
    assert thick[Layer.BONE] == pytest.approx(bone, abs=0.011)
    assert thick[Layer.GROUND] == 0.0
    mirrored = layer_at(layers, distance, (6.0, 0.2, 0.2) - line).layer
    assert np.count_nonzero(mirrored != found.layer) <= 4


def test_the_stored_walls_hold_as_much_bone_as_the_model(head: Phantom) -> None:
    """Sampled in the volumes at 0.5 mm, a ball at the lamina has its bone."""
    names = np.array([kind.name for kind in head.layers.kinds])
    depth = head.distance.values
    for plate in ("lamina papyracea", "fovea ethmoidalis"):
        at = names[head.layers.wall.values] == plate
        places = np.argwhere(at & (depth > 0.3) & (depth < 0.6))
        inner = (places > 8).all(axis=1) & (places < np.array(depth.shape) - 9).all(1)
        places = places[inner]
        stored, expected = 0.0, 0.0
        for k, j, i in places[np.random.default_rng(2).permutation(len(places))[:3]]:
            center = head.ct.origin_mm + 0.5 * np.array([i, j, k])
            model = layer_volumes(head.parameters, center, center, 1.5)
            expected += model.all_bone_mm3
            side = np.arange(-1.5, 1.5, 0.05) + 0.025
            cube = np.stack(np.meshgrid(side, side, side, indexing="ij"), -1)
            ball = cube[np.linalg.norm(cube, axis=-1) <= 1.5] + center
            found = layer_at(head.layers, head.distance, ball)
            stored += 0.05**3 * np.count_nonzero(found.layer == Layer.BONE)
        assert stored == pytest.approx(expected, rel=0.12)


@given(
    st.floats(-0.25, 0.25),
    st.floats(0.9, 1.6),
    st.tuples(*(st.floats(-1.0, 1.0) for _ in range(3))).filter(
        lambda way: np.linalg.norm(way) > 0.2
    ),
)
def test_the_middle_of_a_thin_wall_is_not_cut_off(
    shift: float, total: float, way: tuple[float, float, float]
) -> None:
    """Trilinear interpolation loses up to half a voxel of its depth there."""
    normal = np.array(way) / np.linalg.norm(way)
    grid = 0.5 * np.indices((25, 25, 25))[::-1] - 6.0
    across = np.tensordot(normal, grid, 1) - shift
    depth = np.minimum(total / 2 + across, total / 2 - across)
    distance = Volume(depth.astype(np.float32), np.full(3, 0.5), np.full(3, -6.0))
    kind = WallKind("septum", 0.4, 0.25, int(Label.MUCOSA), 23)
    one = distance.with_values(np.ones(distance.shape, np.uint8), 0.0)
    layers = WallLayers(one, one, (WallKind("", 0, 0, 0, 0), kind))
    places = np.random.default_rng(3).uniform(-3, 3, (200, 3))
    places -= (places @ normal - shift)[:, None] * normal
    found = layer_at(layers, distance, places)
    assert found.depth_mm == pytest.approx(np.full(200, total / 2), abs=0.26)
    assert np.median(found.depth_mm) == pytest.approx(total / 2, abs=0.1)
    off = places + np.linspace(-3, 3, 200)[:, None] * normal
    true = total / 2 - np.abs(off @ normal - shift)
    error = layer_at(layers, distance, off).depth_mm - true
    tissue = true > 0.01
    assert error[tissue].max(initial=0.0) < 0.05
    assert error[tissue].min(initial=0.0) > -0.27


def test_walls_between_cells_hold_their_bone(head: Phantom) -> None:
    depth, labels = head.distance.values, head.labels.values
    cells = (Label.ANTERIOR_ETHMOID_AIR, Label.POSTERIOR_ETHMOID_AIR)
    air = np.argwhere(np.isin(labels, cells) & (depth < -0.6) & (depth > -3.0))
    places = air[:, ::-1] * 0.5 + head.ct.origin_mm
    places = places[(places[:, 1] > 19.0) & (places[:, 1] < 50.0)]
    random = np.random.default_rng(0)
    places = places[random.permutation(len(places))[:10_000]]
    ways = random.normal(size=places.shape)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    t = np.arange(0.0, 6.0, 0.02)
    line = places[:, None] + t[None, :, None] * ways[:, None]
    layer = layer_at(head.layers, head.distance, line).layer
    thick = []
    for i in range(len(places)):
        tissue = layer[i] != Layer.AIR
        start = int(np.argmax(tissue))
        end = start + int(np.argmax(~tissue[start:]))
        if end == start or not 0.9 < 0.02 * (end - start) < 1.8:
            continue
        beyond = np.rint((line[i, end] - head.ct.origin_mm) / 0.5).astype(int)[::-1]
        if (beyond < 0).any() or (beyond >= depth.shape).any():
            continue
        if labels[tuple(beyond)] in cells:
            thick.append(0.02 * np.count_nonzero(layer[i, start:end] == Layer.BONE))
    assert len(thick) > 100
    assert np.mean(np.array(thick) > 0) > 0.8
    # Rays are oblique, and walls of rounded cells curved: eight draws of rays had means
    # of .321 to .343 mm. Their medians, .34 to .38, go in the steps of the rays.
    cell = head.parameters.cell_bone_mm
    assert 0.8 * cell <= np.mean(thick) <= 1.45 * cell
