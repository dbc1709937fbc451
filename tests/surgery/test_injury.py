"""Nothing enters what must not be hurt unseen, at any speed, and nothing is made up."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy import PhantomParameters, sinus_phantom
from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.tissue import Label
from anatomy.wall_layers import WallKind, WallLayers, layer_at
from renderers.scene import Change, Volume
from surgery import solids
from surgery.edit import Edit
from surgery.injury import ABSENT_S, InjuryWatch
from surgery.kernels.sweep_hazard import CLOSE_MM, TOL_MM, steepest
from surgery.straight_way import STRIKES_MM_S

Vector = NDArray[np.float64]

SPACING_MM = 0.5
HALF = 40
SURFACE_MM = 2.0
"""x of the air's surface: air on the side of less x."""

MUCOSA_MM, BONE_MM = 1.0, 0.5
BEHIND_MM = SURFACE_MM + MUCOSA_MM + BONE_MM
"""x of the hazard's face: a half space, or a ball that reaches to there."""

BALL_MM = 5.0
MIDDLE = np.array((BEHIND_MM + BALL_MM, 0.0, 0.0))


def places() -> Vector:
    """World mm of each voxel, ``(nz, ny, nx, 3)``."""
    axis = (np.arange(2 * HALF + 1) - HALF) * SPACING_MM
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.stack([x, y, z], axis=-1)


def volume(values: NDArray[np.generic], background: float = 0.0) -> Volume:
    return Volume(
        values, np.full(3, SPACING_MM), np.full(3, -HALF * SPACING_MM), np.eye(3),
        background,
    )  # fmt: skip


WHERE = places()
DEPTH = volume((WHERE[..., 0] - SURFACE_MM).astype(np.float32), 6.0)
PLANE = volume(np.rint((BEHIND_MM - WHERE[..., 0]) / UNIT_MM).astype(np.int16), 2500.0)
BALL = volume(
    np.rint((np.linalg.norm(WHERE - MIDDLE, axis=-1) - BALL_MM) / UNIT_MM).astype(
        np.int16
    ),
    2500.0,
)
LAYERS = WallLayers(
    volume(np.ones(WHERE.shape[:3], np.uint8)),
    volume(np.full(WHERE.shape[:3], Label.FAT, np.uint8)),
    (
        WallKind("", 0.0, 0.0, 0, 0),
        WallKind(
            "lamina papyracea",
            MUCOSA_MM,
            BONE_MM,
            Label.MUCOSA,
            Label.LAMINA_PAPYRACEA,
            9.0,
            "orbit",
        ),
    ),
)


def watch(hazard: Volume = PLANE, layers: WallLayers | None = LAYERS) -> InjuryWatch:
    return InjuryWatch(HazardVolumes({"orbit": hazard}), layers, DEPTH, near_mm=np.inf)


def ball(place: Vector, radius_mm: float) -> solids.Rows:
    return solids.capsule(place, place, radius_mm)


def stroke(
    watched: InjuryWatch,
    way: list[Vector],
    radius_mm: float,
    pieces: int = 1,
    by: str = "probe",
) -> None:
    """Go from place to place, a second each, in so many samples."""
    time_s = 0.0
    watched.move(by, time_s, ball(way[0], radius_mm))
    for a, b in pairwise(way):
        for n in range(1, pieces + 1):
            at = ball(a + n / pieces * (b - a), radius_mm)
            watched.move(by, time_s + n / pieces * ABSENT_S, at)
        time_s += ABSENT_S


spots = st.tuples(*([st.floats(-15.0, 15.0)] * 3)).map(np.array)
radii = st.floats(0.1, 2.0)


@given(spots, spots, radii, st.integers(1, 40))
def test_the_nearest_approach_is_that_of_dense_sampling(
    a: Vector, b: Vector, radius_mm: float, pieces: int
) -> None:
    """For a ball as hazard it is the distance of a segment from its middle."""
    watched = watch(BALL)
    stroke(watched, [a, b], radius_mm, pieces)
    dense = a + np.linspace(0.0, 1.0, 4001)[:, None] * (b - a)
    expected = float(BALL.sample(dense).min()) * UNIT_MM - radius_mm
    found = watched.approaches["orbit"]
    assert found.gap_mm == pytest.approx(expected, abs=0.1)
    # the place that is told is the tool's, and as near
    if expected > 0.0:
        told = float(BALL.sample(found.place_mm)) * UNIT_MM
        assert told == pytest.approx(found.gap_mm, abs=0.05 + radius_mm / 50)


@given(spots, spots, radii, st.integers(2, 60))
def test_a_stroke_is_judged_alike_however_it_is_sampled(
    a: Vector, b: Vector, radius_mm: float, pieces: int
) -> None:
    whole, cut = watch(BALL), watch(BALL)
    stroke(whole, [a, b], radius_mm)
    stroke(cut, [a, b], radius_mm, pieces)
    depth = max((i.depth_mm for i in whole.injuries + cut.injuries), default=0.0)
    if depth > 0.2:
        assert len(whole.injuries) == len(cut.injuries)
    speed = float(np.linalg.norm(b - a)) / ABSENT_S
    for one, other in zip(whole.injuries, cut.injuries, strict=False):
        assert one.wall == other.wall
        assert one.depth_mm == pytest.approx(other.depth_mm, abs=0.1)
        if depth > 1.0:
            assert np.abs(one.place_mm - other.place_mm).max() < 0.6
            assert abs(one.time_s - other.time_s) * speed < 0.6


@given(
    st.floats(-12.0, 0.0),
    st.floats(0.5, 10.0),
    st.floats(-8.0, 8.0),
    radii,
    st.integers(1, 20),
)
def test_an_entry_has_its_time_place_and_depth(
    from_mm: float, beyond_mm: float, aside: float, radius_mm: float, pieces: int
) -> None:
    """Straight through a flat wall: closed forms."""
    watched = watch()
    start = np.array((from_mm, aside, 1.0))
    end = np.array((BEHIND_MM - radius_mm + beyond_mm, aside, 1.0))
    stroke(watched, [start, end], radius_mm, pieces)
    (injury,) = watched.injuries
    assert (injury.structure, injury.wall, injury.by) == (
        "orbit",
        "lamina papyracea",
        "probe",
    )
    assert injury.side == "left"
    assert injury.depth_mm == pytest.approx(beyond_mm, abs=0.1)
    share = (BEHIND_MM - radius_mm - from_mm) / (end[0] - from_mm)
    late_mm = (injury.time_s / ABSENT_S - share) * (end[0] - from_mm)
    assert 0.0 <= late_mm <= 0.2
    assert injury.place_mm == pytest.approx((BEHIND_MM, aside, 1.0), abs=0.2)


def test_a_thousand_fast_strokes_none_missed_none_made_up() -> None:
    """At 10 m/s and 100 Hz a stroke passes 100 mm in one sample."""
    rng = np.random.default_rng(5)
    missed, made_up, entered = 0, 0, 0
    watched = watch(BALL, None)
    for number in range(1000):
        a = rng.uniform(-18.0, 18.0, 3)
        way = MIDDLE + rng.normal(0.0, 6.0, 3) - a
        b = a + way / np.linalg.norm(way) * rng.uniform(5.0, 100.0)
        radius = float(rng.uniform(0.1, 2.0))
        before = len(watched.injuries)
        stroke(watched, [a, b], radius, by=str(number))
        found = len(watched.injuries) > before
        dense = a + np.linspace(0.0, 1.0, 5001)[:, None] * (b - a)
        # beside the grid is no head
        on = np.all(np.abs(dense) <= HALF * SPACING_MM - radius, axis=1)
        gap = np.linalg.norm(dense - MIDDLE, axis=1) - BALL_MM - radius
        gap = float(np.min(gap, initial=math.inf, where=on))
        entered += gap < -0.15
        missed += gap < -0.15 and not found
        made_up += found and gap > 0.15
    assert entered > 100
    assert missed == made_up == 0


@given(st.floats(-0.3, 0.9), radii)
def test_to_touch_or_dent_mucosa_is_no_injury(dent_mm: float, radius_mm: float) -> None:
    """Even where the hazard begins right below it."""
    near = volume(
        np.rint((SURFACE_MM - WHERE[..., 0]) / UNIT_MM).astype(np.int16), 2500.0
    )
    watched = watch(near)
    deepest = SURFACE_MM + dent_mm - radius_mm
    way = [np.array((x, -5.0, 2.0)) for x in (-9.0, deepest)]
    way += [np.array((deepest, 5.0, 2.0)), np.array((-9.0, 5.0, 2.0))]
    stroke(watched, way, radius_mm)
    assert watched.injuries == ()
    assert watched.approaches["orbit"].gap_mm == pytest.approx(-dent_mm, abs=0.1)


def test_a_tool_that_stays_is_counted_once_and_one_that_returns_again() -> None:
    watched = watch()
    out, in_ = np.array((-5.0, 0.0, 0.0)), np.array((4.0, 0.0, 0.0))
    watched.move("curette", 0.0, ball(out, 1.0))
    trembling = np.random.default_rng(1).normal(0.0, 0.1, (200, 3))
    for n, shake in enumerate(trembling):
        watched.move("curette", 0.01 * (n + 1), ball(in_ + shake, 1.0))
    assert [injury.by for injury in watched.injuries] == ["curette"]
    assert watched.injuries[0].depth_mm == pytest.approx(
        4.0 + 1.0 + trembling[:, 0].max() - BEHIND_MM, abs=0.1
    )
    # to the surface is not out
    edge = np.array((BEHIND_MM - 1.0 - 0.5 * CLOSE_MM, 0.0, 0.0))
    watched.move("curette", 2.1, ball(edge, 1.0))
    watched.move("curette", 2.2, ball(in_, 1.0))
    assert [injury.by for injury in watched.injuries] == ["curette"]
    watched.move("curette", 2.3, ball(out, 1.0))
    watched.move("curette", 2.4, ball(in_, 1.0))
    found = watched.injuries
    first, second = found[0], found[-1]
    assert len(found) == 2
    assert not first.through_hole
    assert second.through_hole


def test_both_ways_through_in_one_sample_is_one_entry_each() -> None:
    """In and out again between two samples, and the sides are told apart."""
    x = WHERE[..., 0]
    both = volume(np.rint((BEHIND_MM - np.abs(x)) / UNIT_MM).astype(np.int16), 2500.0)
    watched = InjuryWatch(HazardVolumes({"orbit": both}), None, volume(
        (np.abs(x) - SURFACE_MM).astype(np.float32), 6.0
    ))  # fmt: skip
    first = watched.move("probe", 0.0, ball(np.array((-9.0, 0.0, 0.0)), 0.5))
    found = watched.move("probe", 0.01, ball(np.array((9.0, 0.0, 0.0)), 0.5))
    assert [injury.side for injury in (*first, *found)] == ["right", "left"]
    assert watched.injuries == (*first, *found)
    middle = 0.01 * (9.0 + BEHIND_MM - 0.5) / 18.0
    assert found[0].time_s == pytest.approx(middle, abs=0.01 * 0.2 / 18.0)


@given(spots, spots, st.floats(0.2, 2.0), st.integers(1, 8))
def test_a_shaft_is_as_its_densely_sampled_balls(
    tip: Vector, moved: Vector, radius_mm: float, pieces: int
) -> None:
    """A long shaft's flank counts like its tip."""
    axis = np.array((-0.6, 0.64, 0.48)) * 12.0
    swung = np.array((-0.9, -0.3, 0.1)) * 12.0
    watched = watch(BALL, None)
    for n in range(pieces + 1):
        t = n / pieces
        a = tip + t * (moved - tip)
        b = a + axis + t * (swung - axis)
        watched.move("shaft", 0.1 * t, solids.capsule(a, b, radius_mm))
    share = np.linspace(0.0, 1.0, 161)
    u, s = share[:, None, None], share[None, :, None]
    rows = tip + u * (moved - tip) + s * (axis + u * (swung - axis))
    expected = float(BALL.sample(np.clip(rows, -20.0, 20.0)).min()) * UNIT_MM
    found = watched.approaches["orbit"].gap_mm
    step = max(float(np.linalg.norm(moved - tip)), 12.0) / 160
    assert expected - radius_mm - step < found < expected - radius_mm + 0.1


def plate(thickness_mm: float) -> tuple[Volume, Volume]:
    """A septum: mucosa on both faces; the hazard begins at the mucosa."""
    x: Vector = np.abs(WHERE[..., 0]) - thickness_mm / 2
    values = np.rint(x / UNIT_MM).astype(np.int16)
    return volume((-x).astype(np.float32), 6.0), volume(values, 2500.0)


def test_a_septum_is_perforated_past_its_middle() -> None:
    depth, hazard = plate(3.0)
    for reach_mm, count in ((-0.4, 0), (0.6, 1), (4.0, 1)):
        watched = InjuryWatch(
            HazardVolumes({"septum": hazard}), LAYERS, depth, near_mm=np.inf
        )
        end = np.array((reach_mm - 1.0, 0.0, 0.0))
        stroke(watched, [np.array((-9.0, 0.0, 0.0)), end], 1.0)
        assert len(watched.injuries) == count, reach_mm


@given(st.floats(0.0, SPACING_MM), st.floats(0.2, 2.0))
def test_a_thin_walls_bone_is_passed_in_its_middle(
    middle_mm: float, radius_mm: float
) -> None:
    """Wherever the middle lies between voxels, where interpolation cuts it off."""
    total = MUCOSA_MM + BONE_MM
    ridge = total + 0.02 - np.abs(WHERE[..., 0] - middle_mm)
    face = middle_mm - 0.3
    hazard = np.rint((face - WHERE[..., 0]) / UNIT_MM).astype(np.int16)
    for short_mm, count in ((0.2, 0), (0.04, 1)):
        watched = InjuryWatch(
            HazardVolumes({"orbit": volume(hazard, 2500.0)}),
            LAYERS,
            volume(ridge.astype(np.float32), 6.0),
            near_mm=np.inf,
        )
        end = np.array((middle_mm - short_mm - radius_mm, 0.0, 0.0))
        stroke(watched, [end - (8.0, 0.0, 0.0), end], radius_mm)
        assert len(watched.injuries) == count, short_mm


def edit(rows: solids.Rows, time_s: float = 3.0) -> Edit:
    corners = np.zeros(3, np.int64), np.ones(3, np.int64)
    return Edit(1, time_s, 1, "punch", rows, {}, {}, 0.0, 1, Change(1, *corners))


@given(st.floats(-1.0, 2.0), st.floats(0.6, 2.0), st.floats(0.0, 6.0))
def test_a_cut_injures_what_it_reaches(
    beyond_mm: float, radius_mm: float, length: float
) -> None:
    x = BEHIND_MM + beyond_mm - radius_mm
    rows = solids.capsule((x, 0.0, 0.0), (x, length, 0.0), radius_mm)
    watched = watch()
    away: Vector = WHERE - np.array((x, 0.0, 0.0))
    away[..., 1] -= np.clip(away[..., 1], 0.0, length)
    tool = np.linalg.norm(away, axis=-1) - radius_mm
    carved = volume(np.minimum(DEPTH.values, tool).astype(np.float32), 6.0)
    found = watched.cut(edit(rows), carved)
    # cut out on a grid, a small ball loses some of its reach
    loss = SPACING_MM**2 / (2.0 * radius_mm) + 0.15
    if beyond_mm < 0.0:
        assert found == ()
    if beyond_mm > loss + 0.1:
        (injury,) = found
        assert injury.by == "punch"
        assert injury.time_s == 3.0
        assert injury.wall == "lamina papyracea"
        assert beyond_mm - loss < injury.depth_mm < beyond_mm + 0.05


def test_a_cut_that_spares_bone_injures_nothing() -> None:
    """What the tool had to leave is still there."""
    rows = solids.capsule((4.0, 0.0, 0.0), (4.0, 6.0, 0.0), 2.0)
    spared = volume(np.maximum(DEPTH.values - MUCOSA_MM, -3.0).astype(np.float32), 6.0)
    watched = watch()
    assert watched.cut(edit(rows), spared) == ()
    assert watched.injuries == ()


def test_a_tool_that_was_away_leaves_no_stroke_behind() -> None:
    left, right = np.array((-15.0, 0.0, 0.0)), np.array((1.0, 14.0, 0.0))
    watched = watch(BALL)
    watched.move("probe", 0.0, ball(left, 0.5))
    watched.move("probe", 2 * ABSENT_S, ball(right, 0.5))
    watched.move("other", 2 * ABSENT_S, ball(left, 0.5))
    watched.leave("other")
    watched.move("other", 2 * ABSENT_S + 0.01, ball(right + 1.0, 0.5))
    nearest = min(float(np.linalg.norm(p - MIDDLE)) for p in (left, right, right + 1.0))
    gap = watched.approaches["orbit"].gap_mm
    assert gap == pytest.approx(nearest - BALL_MM - 0.5, abs=0.1)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_is_no_pose(bad: float) -> None:
    watched = watch()
    rows = ball(np.zeros(3), 0.5)
    watched.move("probe", 0.0, rows)
    broken = rows.copy()
    broken[0, 2] = bad
    assert watched.move("probe", 0.01, broken) == ()
    assert watched.move("probe", 0.02, ball(np.array((9.0, 0.0, 0.0)), 0.5)) != ()


def test_what_cannot_be_watched_is_refused() -> None:
    watched = watch()
    box = solids.blade(np.eye(3)[:2], 2 * np.eye(3)[:2], 0.1)
    with pytest.raises(ValueError, match="capsules"):
        watched.move("probe", 0.0, box)
    with pytest.raises(ValueError, match="one capsule"):
        watched.move("probe", 0.0, np.zeros((0, solids.ROW)))
    with pytest.raises(ValueError, match="one capsule"):
        watched.move("probe", 0.0, np.zeros(7))
    watched.move("probe", 1.0, ball(np.zeros(3), 0.5))
    with pytest.raises(ValueError, match="order of time"):
        watched.move("probe", 0.5, ball(np.zeros(3), 0.5))
    small = Volume(np.zeros((3, 3, 3), np.float32), np.ones(3), np.zeros(3))
    with pytest.raises(ValueError, match="do not fit"):
        InjuryWatch(HazardVolumes({}), LAYERS, small, near_mm=np.inf)


def test_the_steepest_slope_bounds_every_difference() -> None:
    rng = np.random.default_rng(3)
    values = rng.integers(-40, 40, (9, 8, 7)).astype(np.int16)
    rough = Volume(values, np.array((0.5, 0.4, 0.7)), np.zeros(3))
    bound = steepest(rough.values, rough.spacing_mm, UNIT_MM)
    a = rng.uniform(0.0, 1.0, (4000, 3)) * (np.array(rough.shape[::-1]) - 1.01)
    a *= rough.spacing_mm
    b = np.clip(a + rng.normal(0, 0.05, a.shape), 0.0, (a.max(axis=0)))
    rise = np.abs(rough.sample(a) - rough.sample(b)) * UNIT_MM
    assert np.all(rise <= bound * np.linalg.norm(a - b, axis=1) + 1e-9)
    assert TOL_MM < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "behind"),
    [
        ("lamina papyracea", "orbit"),
        ("fovea ethmoidalis", "skull base"),
        ("cribriform plate", "skull base"),
        ("lateral lamella", "skull base"),
        ("sphenoid wall", "internal carotid"),
        ("sphenoid wall", "optic nerve"),
        ("thick bone", "nasolacrimal duct"),
    ],
)
def test_no_named_wall_of_the_phantom_is_passed_unseen(name: str, behind: str) -> None:
    """A thousand strokes of up to 10 m/s, against dense sampling by other code."""
    head = sinus_phantom(PhantomParameters(seed=1))
    layers, depth = head.layers, head.distance
    hazard = head.hazards.volumes[behind]
    rows = [
        row
        for row, kind in enumerate(layers.kinds)
        if (kind.name, kind.behind) == (name, behind)
    ]
    air = (depth.values < -0.3) & (depth.values > -2.5) & (hazard.values > 0)
    starts = np.argwhere(np.isin(layers.wall.values, rows) & air)[:, ::-1]
    rng = np.random.default_rng(7)
    watched = InjuryWatch(head.hazards, layers, depth)
    table = layers.table().sum(axis=1)
    missed, made_up, late, entered = 0, 0, [], 0
    for number in range(1000):
        place = starts[rng.integers(len(starts))]
        a = place * depth.spacing_mm + depth.origin_mm
        radius = float(rng.uniform(0.2, 1.35))
        way = inward(hazard, a) + rng.normal(0.0, 0.3, 3)
        way /= np.linalg.norm(way)
        gap = float(hazard.sample(a)) * UNIT_MM - radius
        length = gap + rng.uniform(-1.5, 4.0) if number % 4 else 100.0
        if gap <= 0.0 or length <= 0.2:
            continue
        dense = a + np.linspace(0.0, 1.0, int(min(length, 12.0) / 0.01))[
            :, None
        ] * way * min(length, 12.0)
        gaps = hazard.sample(dense) * UNIT_MM - radius
        to = inward(hazard, dense)
        reached = layer_at(layers, depth, dense + radius * to)
        passed = reached.depth_mm >= table[reached.wall] - 0.1
        before = depth.sample(dense + (radius - 0.25) * to)
        passed |= before >= reached.depth_mm
        inside = passed & (reached.depth_mm > 0.0)
        watched.move(str(number), 0.0, ball(a, radius))
        found = [
            injury
            for injury in watched.move(
                str(number), 0.01, ball(a + length * way, radius)
            )
            if injury.structure == behind
        ]
        watched.leave(str(number))
        entered += bool(found)
        # a way in that is shorter than 0.15 mm is none
        run = np.convolve(inside & (gaps < -0.15), np.ones(15), "valid") == 15
        deep = np.flatnonzero(run)
        missed += len(deep) > 0 and not found
        made_up += bool(found) and float(gaps.min()) > 0.15 and length <= 12.0
        if found and len(deep) > 0:
            first = int(deep[0]) * 0.01
            late.append(found[0].time_s / 0.01 * length - first)
    assert entered > 300
    assert missed == made_up == 0
    assert np.percentile(late, 99) < 0.15


def inward(hazard: Volume, places: Vector) -> Vector:
    """Return unit directions to a hazard, ``(..., 3)``."""
    slope = np.stack(
        [hazard.sample(places - e) - hazard.sample(places + e) for e in np.eye(3) / 4],
        axis=-1,
    )
    size = np.linalg.norm(slope, axis=-1, keepdims=True)
    unit: Vector = slope / np.maximum(size, 1e-9)
    return unit


@pytest.mark.parametrize("far_mm", [1e4, 1e6, 1e9])
def test_what_lies_outside_the_head_cannot_be_hurt_and_takes_no_time(
    far_mm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A way is followed at any length, if one is said to be one: here each is."""
    monkeypatch.setattr("surgery.injury.is_way", lambda *_: True)
    watched = InjuryWatch(HazardVolumes({"orbit": BALL}), LAYERS, DEPTH)
    for n, x_mm in enumerate((-9.0, -far_mm, -9.0, -far_mm)):
        watched.move("probe", 0.1 * n, ball(np.array((x_mm, 0.0, 0.0)), 0.5))
    assert not watched.injuries
    assert watched.approaches == {}
    # and what lies inside is found on a way from there
    watched.move("probe", 0.4, ball(MIDDLE, 0.5))
    assert [injury.wall for injury in watched.injuries] == ["lamina papyracea"]
    assert watched.injuries[0].place_mm[0] == pytest.approx(BEHIND_MM, abs=0.2)


def test_nothing_is_hurt_on_a_way_that_no_hand_went() -> None:
    """Through the ball, from air to air, faster than a hand; then as fast as one."""
    watched = watch(BALL)
    before, behind = np.array((-9.0, 0.0, 0.0)), np.array((219.0, 0.0, 0.0))
    watched.move("probe", 0.0, ball(before, 0.5))
    assert watched.move("probe", 0.01, ball(behind, 0.5)) == ()
    watched.move("hand", 0.0, ball(before, 0.5))
    assert watched.move("hand", 228.0 / STRIKES_MM_S, ball(behind, 0.5)) != ()
