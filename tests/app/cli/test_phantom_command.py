import json
from dataclasses import replace
from pathlib import Path

import pytest

from anatomy import Opacity
from anatomy.case import read_case
from app.__main__ import main
from app.cli.phantom_command import phantom
from devices import load_probe_path
from paravol.cases.case_options import PhantomOptions
from paravol.exercises.case_scenario import PATH, scenario_of_case
from paravol.patient import load_case, load_scene


def test_a_patient_is_drawn_with_what_was_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["phantom", "--seed", "7", "--spacing", "2", "--json"]
    words += ["--variant", "onodi:left", "--without", "agger-nasi"]
    words += ["--variant", "keros-3"]
    words += ["--lund-mackay", "maxillary:left=2,polyps=1", "--mr"]
    assert main([*words, "--out", str(tmp_path / "case")]) == 0
    said = json.loads(capsys.readouterr().out)
    assert {"onodi:left", "keros-3"} <= set(said["variants"])
    assert not [v for v in said["variants"] if v.startswith("agger-nasi")]
    assert {"ct.nrrd", "t1.nrrd", "t2.nrrd", "case.json"} <= set(said["files"])
    held = read_case(tmp_path / "case").record.parameters
    assert held is not None
    assert held.opacity[1] == Opacity(maxillary=2, polyps=1)
    assert held.opacity[0] == Opacity(polyps=1)
    assert held.ct_noise_hu == 12.0


def test_the_average_adult_can_be_asked_for(tmp_path: Path) -> None:
    options = PhantomOptions(out=tmp_path / "case", spacing=3.0)
    phantom(seed=3, options=replace(options, average=True), json=True)
    held = read_case(tmp_path / "case").record.parameters
    assert held is not None
    assert held.maxillary_scale == 0.97
    assert held.seed == 3
    (tmp_path / "case" / "exercise.toml").write_text("of another head")
    with pytest.raises(
        ValueError, match=r"the case of a phantom \(seed 3\) with its exercise.*--force"
    ):
        phantom(seed=4, options=options, json=True)
    phantom(seed=4, options=replace(options, force=True), json=True)
    held = read_case(tmp_path / "case").record.parameters
    assert held is not None
    assert held.seed == 4
    assert not (tmp_path / "case" / "exercise.toml").exists()


def test_disease_is_made_recounted_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["phantom", "--average", "--spacing", "2", "--out", str(tmp_path / "case")]
    words += ["--disease", "fluid:maxillary:left=0.4,antrostomy:left=60"]
    words += ["--disease", "polyps:right=1", "--lund-mackay", "sphenoid:right=2"]
    words += ["--congestion", "0.5", "--posture", "upright"]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "Lund-Mackay score 3 of 24: right 2, left 1" in said
    assert "antrostomy:left=60" in said
    record = read_case(tmp_path / "case").record
    assert record.disease is not None
    assert record.disease.right == Opacity(sphenoid=2, polyps=1)
    assert record.disease.left == Opacity(maxillary=1)
    assert record.parameters is not None
    assert record.parameters.congestion == 0.5
    assert record.parameters.posture == "upright"


def test_a_word_of_no_disease_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["phantom", "--disease", "kidney=2", "--out", str(tmp_path / "x")]
    assert main(words) == 1
    assert "disease reads" in capsys.readouterr().err


def test_an_unknown_variant_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["phantom", "--variant", "third-nostril", "--out", str(tmp_path / "x")]
    assert main(words) == 1
    assert "there is no variant 'third-nostril'" in capsys.readouterr().err


def test_a_scene_is_written_as_a_case_that_can_be_flown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "case"
    words = ["phantom", "--scene", "niches", "--seed", "3", "--spacing", "1", "--json"]
    assert main([*words, "--out", str(out)]) == 0
    assert "target A" in json.loads(capsys.readouterr().out)["landmarks"]
    made, read = load_scene("niches", 3, 1.0), load_case(out)
    assert read.surface_sha256 == made.surface_sha256
    assert read.way_in is not None
    assert made.way_in is not None
    assert read.way_in.free_mm == made.way_in.free_mm
    assert read.landmarks.keys() == made.landmarks.keys()
    # a flight along the free way stays in the space
    path = load_probe_path(scenario_of_case(out).parent / PATH)
    inside = path.tip_mm[path.tip_mm[:, 1] >= read.way_in.pivot_mm[1]]
    assert inside[:, 1].max() > 50.0
    assert read.surface.distance.sample(inside).max() < 0.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--scene", "hops"], "did you mean 'hoops'"),
        (["--scene", "hoops", "--mr"], "A scene has no --mr"),
    ],
)
def test_a_scene_that_there_is_not_is_refused(
    tmp_path: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["phantom", *words, "--out", str(tmp_path / "case")]) != 0
    assert said in capsys.readouterr().err
    assert not (tmp_path / "case").exists()
