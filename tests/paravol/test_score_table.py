from paravol.score_table import score_rows
from scenarios import Score


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
