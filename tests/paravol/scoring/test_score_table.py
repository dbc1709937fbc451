from paravol.scoring.score_table import score_rows
from scenarios import Score
from scenarios.hazard_watch import HazardApproach
from scenarios.metrics import Metric
from scenarios.scoring import BreakFigure, InjuryFigure, OperationFigures


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
        "path length (gauge)": "123 mm",
        "smallest clearance": "-0.50 mm",
        "contacts (gauge)": "1, 30.0 s in all (79%)",
        "pressed deeper than 0.3 mm": "12.0 s",
        "deepest contact (gauge)": "0.50 mm, septum",
        "touched (gauge)": "septum 22.0 s; skin 8.0 s",
        "nearest to: middle meatus, right": "1.26 mm",
        "nearest to: nasopharynx": "20 mm",
    }


def test_without_contact_there_is_nothing_to_tell_of_any() -> None:
    rows = score_rows(Score(0.0, 0.0, float("inf"), 0, {}))
    assert rows[2:] == [("contacts (gauge)", "none"), ("smallest clearance", "unknown")]


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


def test_what_was_measured_takes_the_place_of_the_gauges() -> None:
    """One page told 12 mm and 13.5 mm of path: the gauge's and the metric's."""
    score = Score(9.0, 12.0, 1.0, 3, {"choana": 4.0}, contact_s=1.0)
    metrics = [
        Metric("path length", "scope", "mm", 13.5, sigma=1e-15),
        Metric("path length", "tool", "mm", 99.0),
        Metric("contacts", "scope", "count", 2.0),
        Metric("nearest to: choana", "scope", "mm", 3.9),
    ]
    told = score_rows(score, metrics)
    assert told[:3] == [
        ("path length", "13.5 mm"),
        ("contacts", "2"),
        ("nearest to: choana", "3.9 mm"),
    ]
    names = [name for name, _ in told]
    assert len(set(names)) == len(names)
    assert not [name for name in names if "gauge" in name]


def test_breaks_and_injuries_are_told_though_nothing_was_cut() -> None:
    hurt = InjuryFigure(3.0, "orbit", "", "right", [0.0, 0.0, 0.0], 2.8, "curette")
    figures = OperationFigures(
        injuries=[hurt],
        greatest_n=91.0,
        broken_walls={"thin bone": 2},
        breaks=[
            BreakFigure(1.5, "thin bone", 24.0, "curette"),
            BreakFigure(2.5, "thin bone", 91.0, "curette"),
        ],
    )
    told = score_rows(Score(9.0, 0.0, 1.0, 0, {}, operation=figures))
    assert told[4:] == [
        ("greatest force", "tool 91.0 N, scope 0.0 N"),
        ("broken", "thin bone, at 24.0 N by the curette, 1.5 s"),
        ("broken", "thin bone, at 91.0 N by the curette, 2.5 s"),
        ("injury: orbit", "2.8 mm deep at 3.0 s, right, no bone there, by the curette"),
    ]
    old = OperationFigures(broken_walls={"thin bone": 2})
    told = score_rows(Score(9.0, 0.0, 1.0, 0, {}, operation=old))
    assert told[4:] == [("broken", "thin bone 2 x")]
