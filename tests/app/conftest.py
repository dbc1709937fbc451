from pathlib import Path

import numpy as np
import pytest

from devices import ProbePath, load_probe_path, save_probe_path
from scenarios import load_scenario

FIRST_S, LAST_S = 8.0, 10.0


@pytest.fixture(scope="session")
def coarse_scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The whole bundled flight through a coarse head."""
    folder = tmp_path_factory.mktemp("coarse")
    _, bundled = load_scenario("first_flight")
    path = (bundled / "first_flight.path.json").read_bytes()
    (folder / "first_flight.path.json").write_bytes(path)
    text = (bundled / "first_flight.toml").read_text()
    coarse = text.replace("spacing_mm = 0.5", "spacing_mm = 1.0")
    (folder / "coarse.toml").write_text(coarse)
    return folder / "coarse.toml"


@pytest.fixture(scope="session")
def short_scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of the bundled flight through a coarse head."""
    folder = tmp_path_factory.mktemp("scenario")
    scenario, bundled = load_scenario("first_flight")
    whole = load_probe_path(bundled / scenario.path)
    part = (whole.t_s >= FIRST_S) & (whole.t_s <= LAST_S)
    times = np.round(whole.t_s[part] - FIRST_S, 6)
    save_probe_path(
        ProbePath(
            name="short",
            t_s=times,
            tip_mm=whole.tip_mm[part],
            axis=whole.axis[part],
            roll_deg=whole.roll_deg[part],
            instrument_tip_mm=whole.instrument_tip_mm[part],
            instrument_axis=whole.instrument_axis[part],
            buttons=whole.buttons[part],
        ),
        folder / "short.path.json",
    )
    text = (bundled / "first_flight.toml").read_text()
    for old, new in (
        ('name = "first_flight"', 'name = "short"'),
        ("first_flight.path.json", "short.path.json"),
        ("spacing_mm = 0.5", "spacing_mm = 1.0"),
        ("time_s = 9.5", "time_s = 1.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    # the later moments lie beyond these two seconds
    first, second, *_ = text.split("[[moments]]")
    (folder / "short.toml").write_text(f"{first}[[moments]]{second}")
    return folder / "short.toml"
