from pathlib import Path

import msgspec
import pytest

from scenarios import Scenario, load_scenario
from scenarios.exercise_check import HeadNames, head_problems
from scenarios.scenario import Head
from scenarios.tasks.task import KeepAway, Limits, Reach, Remove, Survey, Task
from system import UserError

GOOD = """
name = "own"
title = "One's own"
path = "own.path.json"
fiducials = [
  {name = "a", position_mm = [0, 0, 0]},
  {name = "b", position_mm = [9, 0, 0]},
  {name = "c", position_mm = [0, 9, 0]},
  {name = "d", position_mm = [0, 0, 9]},
]

[scope]
diameter_mm = 4.0
angle_deg = 30.0
ring_radius_mm = 1.45

[[moments]]
name = "first"
time_s = 2.5
"""


def test_a_file_of_ones_own_loads(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(GOOD)
    scenario, folder = load_scenario(str(tmp_path / "own.toml"))
    assert folder == tmp_path
    assert scenario.scope.endoscope().angle_deg == 30.0
    assert scenario.moments[0].time_s == 2.5
    assert scenario.head.seed == 1
    assert scenario.fiducial_positions()["b"].tolist() == [9, 0, 0]


def test_attempts_have_patients_of_their_own_and_an_examination_has_one() -> None:
    anew = Head(seed=1, patients=(5, 2, 9), variants=("haller:right",))
    heads = [anew.of_attempt(attempt) for attempt in (1, 2, 3, 4)]
    assert [head.number for head in heads] == [5, 2, 9, 5]
    assert heads[2] == Head(patients=(9,), variants=("haller:right",))
    assert anew.of_patient(7).number == anew.of_patient(7).of_attempt(3).number == 7
    assert Head(seed=5).of_attempt(3) == Head(seed=5)
    for own in (Head(scene="hoops"), Head(case="/case")):
        assert own.of_attempt(3) == own.of_patient(9) == own


def test_a_scene_is_not_drawn(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(GOOD + '[head]\nscene = "hoops"\npatients = [3]\n')
    with pytest.raises(UserError, match="phantom"):
        load_scenario(str(file))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (('name = "own"', 'nmae = "own"'), "nmae"),
        (("angle_deg = 30.0", "angle_deg = 130.0"), "angle"),
        (("angle_deg = 30.0", 'angle_deg = "thirty"'), "angle_deg"),
        (('  {name = "d", position_mm = [0, 0, 9]},\n', ""), "at least 4"),
        (('"own.path.json"', '"../../etc/passwd"'), "beside it"),
        (("[scope]", "[scope"), "not valid"),
    ],
)
def test_mistakes_are_named(
    tmp_path: Path, change: tuple[str, str], complaint: str
) -> None:
    (tmp_path / "own.toml").write_text(GOOD.replace(*change))
    with pytest.raises(ValueError, match=complaint):
        load_scenario(str(tmp_path / "own.toml"))


def test_unknown_names_list_the_known_ones() -> None:
    with pytest.raises(ValueError, match="There is no scenario named 'nose-job'"):
        load_scenario("nose-job")


def test_a_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="cannot be read"):
        load_scenario(str(tmp_path / "none.toml"))


ALONE = """
name = "alone"
title = "Without a path"
level = "intermediate"
tools = ["straight forceps", "microdebrider"]
hints = ["Slowly."]

[head]
variants = ["concha-bullosa:right"]

[start]
nostril = "left"

[[tasks]]
kind = "look"
name = "meatus"
title = "Look at the middle meatus"
place = "middle meatus, left"

[[tasks]]
kind = "remove"
name = "uncinate"
title = "Take the uncinate process"
after = ["meatus"]
tissues = {uncinate = {least_mm3 = 20.0}}

[[tasks]]
kind = "survey"
name = "see"
title = "See the middle meatus"
sites = {"middle meatus, left" = 60.0, septum = 20.0}

[pass]
tasks = ["meatus"]
metrics = [{name = "hazard dose: orbit", most = 1.0}]
"""


def written(folder: Path, text: str) -> str:
    (folder / "alone.toml").write_text(text)
    return str(folder / "alone.toml")


def test_an_exercise_needs_no_path(tmp_path: Path) -> None:
    scenario, _ = load_scenario(written(tmp_path, ALONE))
    assert scenario.path == ""
    assert scenario.start.nostril == "left"
    # the mock head is registered by its own divots
    assert len(scenario.fiducials) == 4
    # a recording keeps the exercise as JSON, limits without a bound included
    again = msgspec.json.decode(msgspec.json.encode(scenario), type=Scenario)
    assert again == scenario


@pytest.mark.parametrize(
    ("old", "new", "line", "word"),
    [
        ('after = ["meatus"]', 'after = ["meatis"]', 24, "'meatus'"),
        ("uncinate = {", "uncinat = {", 25, "'uncinate'"),
        ('"microdebrider"', '"microdebridder"', 5, "'microdebrider'"),
        ('"concha-bullosa:right"', '"concha-bulosa"', 9, "concha-bullosa"),
        ('"hazard dose: orbit"', '"hazard doze: orbit"', 35, "'hazard dose'"),
        (", most = 1.0", "", 35, "least, most"),
        ('"hazard dose: orbit"', '"unsteadiness"', 35, "measured for targets"),
        ('tasks = ["meatus"]', 'tasks = ["meatos"]', 34, "'meatus'"),
        (
            '"middle meatus, left" =',
            '"midle meatus, left" =',
            31,
            "middle meatus, left",
        ),
        ("septum = 20.0", "septum = 120.0", 31, "0 to 100 percent"),
        ('name = "uncinate"', 'name = "meatus"', 22, "Two tasks"),
        ('nostril = "left"', "tip_mm = [0, 0, 0]", 11, "neither"),
        ('kind = "look"', 'kind = "lok"', 15, "'look'"),
        ('level = "inter', 'level = "intre', 4, "'intermediate'"),
    ],
)
def test_a_typo_is_told_with_its_line_and_the_nearest_word(
    tmp_path: Path, old: str, new: str, line: int, word: str
) -> None:
    assert old in ALONE
    with pytest.raises(UserError) as told:
        load_scenario(written(tmp_path, ALONE.replace(old, new)))
    assert f"alone.toml, line {line}" in str(told.value)
    assert word in str(told.value)


@pytest.mark.parametrize(
    ("task", "place", "word"),
    [
        (Reach(name="r", title="", place="nostrul, left", radius_mm=1.0), 0, "nostril"),
        (
            KeepAway(
                name="k", title="", hazards=("orbits",), margin_mm=1.0, most_dose_s=1.0
            ),
            0,
            "'orbit'",
        ),
        (Remove(name="w", title="", walls={"lamina": Limits()}), 0, "lamina"),
        (Survey(name="s", title="", sites={"polyp": 50.0}), 0, "middle meatus"),
    ],
)
def test_names_are_checked_against_the_head(task: Task, place: int, word: str) -> None:
    scenario = Scenario("s", "S", tasks=(task,))
    head = HeadNames(
        {"nostril, left"}, {"orbit"}, {"lamina papyracea"}, {"middle meatus, left"}
    )
    (problem,) = head_problems(scenario, head)
    assert word in problem.text
    assert problem.at[:2] == ("tasks", place)
    assert not list(head_problems(Scenario("s", "S"), head))
