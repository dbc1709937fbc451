"""What a snapshot is compared with is the live picture."""

from pathlib import Path

import numpy as np

from app.cli.live_comparison import splatted
from devices import load_probe_path
from paravol.patient import load_patient
from paravol.session_setup import LIVE_TIER, SEED, build_view, first_views
from paravol.snapshots.studio import Studio
from paravol.snapshots.view_sources import view_of
from scenarios import load_scenario

SIZE = 48


def test_a_view_with_a_tool_is_drawn_as_the_window_draws_it(
    coarse_scenario: Path,
) -> None:
    """To the bit, the shadow of the tool included."""
    scenario, folder = load_scenario(str(coarse_scenario))
    room = load_patient(scenario, lambda stage, share: None)
    path = load_probe_path(folder / scenario.path)
    seen = first_views(scenario, room, path, (SIZE, SIZE))[-1]
    drawer = build_view(
        scenario, room, tier=LIVE_TIER, seed=SEED, has_instrument=True, threads=1
    )
    frame = drawer.draw(seen, number=3, elapsed_s=0.0)
    view = view_of(seen, scenario, room, gain=frame.gain, number=3, has_instrument=True)
    studio = Studio(room.scene, room.surface_sha256)
    found = splatted(studio, view, frame.gain, 1)
    assert np.array_equal(found, frame.pixels)
