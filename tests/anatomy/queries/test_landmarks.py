import numpy as np
import pytest

from anatomy.phantom.ethmoid import BULLA, CLEAR_MM, RETROBULBAR, ethmoid
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, distance_at
from anatomy.phantom.population import draw_parameters
from anatomy.phantom.variants import with_variants, without_variants
from anatomy.queries.hazards import hazard_distances
from anatomy.queries.landmarks import VARIANT_PLACES, landmarks, septal_shift
from anatomy.tissue import Label, Side


def test_the_left_has_positive_x_and_sides_mirror() -> None:
    found = landmarks(PhantomParameters(septal_deviation_mm=0.0))
    for key, landmark in found.items():
        assert key == landmark.key
        if landmark.side == Side.LEFT:
            assert landmark.position_mm[0] > 0
            twin = found[key.replace(", left", ", right")].position_mm
            assert landmark.position_mm == pytest.approx(twin * [-1, 1, 1])


def test_a_deviated_septum_shifts_landmarks_to_its_side() -> None:
    # Positive deviation is to the patient's right, which is negative x.
    bent = landmarks(PhantomParameters(septal_deviation_mm=4.0))
    straight = landmarks(PhantomParameters(septal_deviation_mm=0.0))
    for side in ("left", "right"):
        key = f"inferior turbinate head, {side}"
        assert bent[key].position_mm[0] < straight[key].position_mm[0] - 1


AIR = (
    "nostril",
    "nasal valve",
    "middle meatus",
    "sphenoethmoidal recess",
    "choana",
    "maxillary sinus",
    "frontal sinus",
    "sphenoid sinus",
    "maxillary ostium",
    "frontal ostium",
    "sphenoid ostium",
    "eustachian orifice",
)
SOLID = ("inferior turbinate head", "middle turbinate head", "middle turbinate tail")


@pytest.mark.parametrize("side", ["right", "left"])
def test_cavities_are_air_and_turbinates_are_not(side: str) -> None:
    parameters = PhantomParameters()
    found = landmarks(parameters)
    keys = [f"{name}, {side}" for name in AIR + SOLID]
    values = distance_at(parameters, np.array([found[k].position_mm for k in keys]))
    assert np.all(values[: len(AIR)] < 0), dict(zip(keys, values, strict=True))
    assert np.all(values[len(AIR) :] > 0), dict(zip(keys, values, strict=True))


def test_a_head_has_no_landmark_of_what_it_lacks() -> None:
    def names(parameters: PhantomParameters) -> set[str]:
        return set(landmarks(parameters))

    usual = names(PhantomParameters())
    one_sided = names(without_variants(PhantomParameters(), ["agger-nasi:right"]))
    assert usual - one_sided == {"agger nasi, right"}
    bare = names(PhantomParameters(frontal_scale=0.0, variants=()))
    assert usual - bare == {
        f"{name}, {side}"
        for name in (
            "agger nasi",
            "frontal sinus",
            "frontal ostium",
            "retrobulbar recess",
            "suprabullar cell",
        )
        for side in ("right", "left")
    }
    operated = names(PhantomParameters(uncinectomy=True))
    assert usual - operated == {
        f"{name}, {side}"
        for name in ("uncinate process", "hiatus semilunaris")
        for side in ("right", "left")
    }


ON_A_TUBE = {
    "optic canal": "optic nerve",
    "carotid bulge": "internal carotid",
    "vidian canal": "vidian nerve",
    "foramen rotundum": "maxillary nerve",
    "infraorbital canal": "maxillary nerve",
    "sphenopalatine foramen": "sphenopalatine artery",
    "anterior ethmoidal artery": "ethmoidal arteries",
    "posterior ethmoidal artery": "ethmoidal arteries",
}


@pytest.mark.parametrize("variants", [(), ("hanging-artery:left",)])
def test_landmarks_of_canals_lie_in_their_nerve_or_artery(
    variants: tuple[str, ...],
) -> None:
    head = PhantomParameters(septal_deviation_mm=0.0, roof_mm=0.5, variants=variants)
    found = landmarks(head)
    for name, tube in ON_A_TUBE.items():
        for side in ("left", "right"):
            at = found[f"{name}, {side}"].position_mm[None]
            distance = hazard_distances(head, at)[f"{tube}, {side}"][0]
            assert distance < 0.1, (name, side, distance)


def test_landmarks_lie_in_their_labels(phantom: Phantom) -> None:
    expected = {
        "maxillary sinus, left": Label.MAXILLARY_AIR,
        "frontal sinus, left": Label.FRONTAL_AIR,
        "sphenoid sinus, left": Label.SPHENOID_AIR,
        "choana, left": Label.NASAL_AIR,
        "pterygopalatine fossa, left": Label.PTERYGOPALATINE_FOSSA,
        "pterygopalatine fossa, right": Label.PTERYGOPALATINE_FOSSA,
        "superior orbital fissure, left": Label.ORBITAL_FISSURE,
        "superior orbital fissure, right": Label.ORBITAL_FISSURE,
        "sella turcica": Label.BRAIN,
    }
    for key, label in expected.items():
        place = phantom.landmarks[key].position_mm
        assert phantom.labels.nearest(place) == label, key


def test_recesses_and_dehiscences_have_landmarks_on_their_side_only() -> None:
    plain = PhantomParameters(septal_deviation_mm=0.0)
    head = with_variants(
        plain,
        ["lateral-recess:left", "dehiscent-lamina:right", "presellar-sphenoid:right"],
    )
    found = landmarks(head)
    for name, side in (
        ("sphenoid lateral recess", "left"),
        ("lamina dehiscence", "right"),
        ("opticocarotid recess", "left"),
        ("carotid bulge", "left"),
    ):
        other = "left" if side == "right" else "right"
        assert f"{name}, {side}" in found
        assert f"{name}, {other}" not in found
    for name in ("sphenoid lateral recess, left", "opticocarotid recess, left"):
        assert distance_at(head, found[name].position_mm[None])[0] < 0, name
    gap = found["lamina dehiscence, right"].position_mm[None]
    assert abs(hazard_distances(head, gap)["orbit, right"][0]) < 0.3


@pytest.mark.parametrize("variant", VARIANT_PLACES)
def test_a_cells_landmark_is_air_and_there_where_the_cell_is(variant: str) -> None:
    name = VARIANT_PLACES[variant]
    bare = PhantomParameters(variants=(), unevenness=0.0)
    head = with_variants(bare, [f"{variant}:left"])
    assert f"{name}, right" not in landmarks(head)
    mark = landmarks(head)[f"{name}, left"]
    with_it, without = (
        float(distance_at(p, mark.position_mm)[()]) for p in (head, bare)
    )
    assert with_it < -0.6
    # Where there is no retrobulbar recess the bulla reaches the basal lamella.
    assert variant == "retrobulbar-recess" or without > with_it + 0.3


def test_the_bulla_has_a_rear_wall_where_there_is_a_retrobulbar_recess() -> None:
    # The ostium between the two cells lies on the straight line.
    way = np.linspace(BULLA, RETROBULBAR, 60) + np.array([0.0, 0.0, 2.6])
    plain = PhantomParameters(variants=(), unevenness=0.0)
    head = with_variants(plain, ["retrobulbar-recess"])
    for side in (Side.RIGHT, Side.LEFT):
        assert distance_at(head, septal_shift(head, way, side)).max() > 0
        assert RETROBULBAR in ethmoid(head, side).anterior_seeds
        others = np.array(ethmoid(plain, side).anterior_seeds)
        assert np.linalg.norm(others - RETROBULBAR, axis=1).min() > CLEAR_MM


def test_the_olfactory_fossae_are_as_deep_as_each_side_says() -> None:
    head = with_variants(PhantomParameters(), ["keros-1:right", "keros-3:left"])
    found = landmarks(head)
    low = {s: found[f"olfactory fossa, {s}"].position_mm[2] for s in ("right", "left")}
    assert low["right"] - low["left"] == pytest.approx(9.0 - 2.4)
    # Under the plate is air, over it there is none.
    for side, height in low.items():
        place = found[f"olfactory fossa, {side}"].position_mm
        under, over = distance_at(
            head, np.array([[*place[:2], height - 2.0], [*place[:2], height + 1.0]])
        )
        assert under < 0 < over


@pytest.mark.parametrize("seed", range(40))
def test_drawn_heads_have_an_agger_landmark_where_they_have_the_cell(seed: int) -> None:
    parameters = draw_parameters(seed)
    found = landmarks(parameters)
    for side in (Side.RIGHT, Side.LEFT):
        has = parameters.has("agger-nasi", side)
        assert (f"agger nasi, {side.name.lower()}" in found) == has
        aired = parameters.scale("frontal", side) > 0
        assert (f"frontal ostium, {side.name.lower()}" in found) == aired
