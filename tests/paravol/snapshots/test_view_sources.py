"""Views of sessions: what they say of the head that is seen."""

from pathlib import Path

import pytest

from devices import load_probe_path
from paravol.patient import load_patient, no_progress
from paravol.sessions.session_setup import path_view
from paravol.snapshots.head_scene import HeadScene
from paravol.snapshots.view_file import ViewFile, load_view, save_view
from paravol.snapshots.view_sources import view_of
from scenarios import Scenario, load_scenario
from scenarios.scenario import Head


@pytest.mark.parametrize(
    "head",
    [
        Head(spacing_mm=1.0),
        Head(spacing_mm=1.0, decongested=True),
        pytest.param(
            Head(
                spacing_mm=1.0,
                variants=("concha-bullosa",),
                polyps_right=2,
                disease=("fluid:maxillary:left=0.4",),
            ),
            marks=pytest.mark.slow,
        ),
        Head(spacing_mm=1.0, scene="hoops"),
    ],
)
def test_a_saved_view_finds_the_head_it_was_taken_in(
    head: Head, tmp_path: Path
) -> None:
    bundled, folder = load_scenario("first_flight")
    path = load_probe_path(folder / bundled.path)
    scenario = Scenario("short", "Short", head=head)
    patient = load_patient(scenario, no_progress)
    seen = path_view(scenario, patient, path, 5.0, (16, 16))
    file = tmp_path / "a.view.json"
    save_view(file, view_of(seen, scenario, patient))
    view: ViewFile = load_view(file)
    again = HeadScene.of(view.head, no_progress)
    again.demand(view)
    assert again.surface_sha256 == patient.surface_sha256
