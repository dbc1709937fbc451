from paravol.score_table import score_rows
from scenarios import Score
from scenarios.hazard_watch import HazardApproach


def test_every_figure_is_told_and_contacts_say_what_they_were() -> None:
    score = Score(
        duration_s=38.0,
        path_length_mm=123.4,
        min_clearance_mm=-0.5,
        contacts=1,
        target_distance_mm={"middle meatus, right": 1.26, "nasopharynx": 20.0},
        contact_s=30.0,
        pressure_s=12.0,
        worst_depth_mm=0.5,
        worst_structure="septum",
        touched_s={"skin": 8.0, "septum": 22.0},
    )
    assert dict(score_rows(score)) == {
        "time": "38.0 s",
        "path length": "123 mm",
        "smallest clearance": "-0.50 mm",
        "contacts": "1, 30.0 s in all (79%)",
        "pressed deeper than 0.3 mm": "12.0 s",
        "deepest contact": "0.50 mm, septum",
        "touched": "septum 22.0 s; skin 8.0 s",
        "nearest to middle meatus, right": "1.3 mm",
        "nearest to nasopharynx": "20.0 mm",
    }


def test_without_contact_there_is_nothing_to_tell_of_any() -> None:
    rows = score_rows(Score(0.0, 0.0, float("inf"), 0, {}))
    assert rows[2:] == [("smallest clearance", "unknown"), ("contacts", "none")]


def test_hazards_are_told_the_nearest_first_or_that_they_are_unknown() -> None:
    near = {
        "orbit": HazardApproach(4.0, 2.0, 3.21, 1.5),
        "skull base": HazardApproach(9.0, 2.0, 8.0, 1.0, -0.4, 7.25),
        "internal carotid": HazardApproach(22.0, 0.0, 21.0, 0.0),
    }
    rows = score_rows(Score(9.0, 0.0, 1.0, 0, {}, hazards=near))
    assert rows[4:] == [
        ("hazard: skull base", "scope 8.0 mm at 1.0 s; tool -0.4 mm at 7.2 s"),
        ("hazard: orbit", "scope 3.2 mm at 1.5 s"),
    ]
    assert score_rows(Score(9.0, 0.0, 1.0, 0, {}, hazards={}))[4:] == [
        ("hazards", "unknown (no labels)")
    ]
    far = {"orbit": HazardApproach(12.0, 2.0, 11.0, 1.5)}
    assert score_rows(Score(9.0, 0.0, 1.0, 0, {}, hazards=far))[4:] == [
        ("hazards", "none nearer than 10 mm")
    ]
