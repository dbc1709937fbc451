from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devices import load_probe_path
from paravol.patient import load_patient
from paravol.sessions.session_setup import build_view, first_views
from paravol.snapshots.comparison import difference, save_comparison, splatted
from paravol.snapshots.head_scene import HeadScene
from paravol.snapshots.view_sources import view_of
from scenarios import load_scenario


def test_equal_pictures_do_not_differ() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (40, 60, 3), dtype=np.uint8)
    found = difference(picture, picture)
    assert (found.rmse, found.p99) == (0.0, 0.0)
    assert found.ssim == pytest.approx(1.0)


def test_an_offset_is_its_own_rmse() -> None:
    picture = np.full((40, 60, 3), 100, np.uint8)
    found = difference(picture, picture + np.uint8(7))
    assert found.rmse == pytest.approx(7.0)
    assert found.p99 == 7.0


def test_sheet_shows_both_and_where_they_differ(tmp_path: Path) -> None:
    live = np.full((64, 64, 3), 90, np.uint8)
    snapshot = live.copy()
    snapshot[40:50, 10:20] += 64
    file = tmp_path / "error.png"
    found = difference(live, snapshot)
    save_comparison(file, live, snapshot, found, title="t", text={"Title": "t"})
    with Image.open(file) as image:
        sheet = np.asarray(image)
        assert image.info["Title"] == "t"
    band = sheet.shape[0] - 64
    assert np.array_equal(sheet[band:, :64], live)
    assert np.array_equal(sheet[band:, 64:128], snapshot)
    error = sheet[band:, 128:].sum(axis=-1)
    bright = error > 300
    assert bright[40:50, 10:20].all()
    assert bright.sum() == 100


@pytest.mark.parametrize("width", [128, 256, 512])
def test_captions_stay_above_their_pictures(tmp_path: Path, width: int) -> None:
    live = np.zeros((32, width, 3), np.uint8)
    file = tmp_path / "error.png"
    found = difference(live, live + np.uint8(100))
    save_comparison(file, live, live, found, title="a view", text={})
    with Image.open(file) as image:
        band = np.asarray(image)[:-32]
    for column in range(3):
        own = band[:, column * width : (column + 1) * width]
        assert own[:, :-10].any()
        assert not own[:, -10:].any()


SIZE = 48


def test_a_view_with_a_tool_is_drawn_as_the_window_draws_it(
    coarse_scenario: Path,
) -> None:
    """To the bit, the shadow of the tool included."""
    scenario, folder = load_scenario(str(coarse_scenario))
    patient = load_patient(scenario, lambda stage, share: None)
    path = load_probe_path(folder / scenario.path)
    seen = first_views(scenario, patient, path, (SIZE, SIZE))[-1]
    drawer = build_view(scenario, patient, threads=1)
    frame = drawer.draw(seen, number=3, elapsed_s=0.0)
    view = view_of(
        seen, scenario, patient, gain=frame.gain, number=3, has_instrument=True
    )
    head_scene = HeadScene(patient.scene, patient.surface_sha256)
    found = splatted(head_scene, view, frame.gain, 1)
    assert np.array_equal(found, frame.pixels)
