"""What a recording says of its session, made up."""

import numpy as np

from scenarios.bundle import SessionInfo

INFO = SessionInfo(
    scenario_name="test",
    scenario="{}",
    picture_size=(64, 64),
    tier="LIVE",
    seed=3,
    world_from_device=np.eye(4).ravel().tolist(),
    registration_rms_mm=0.1,
    surface_sha256="0" * 64,
    has_instrument=True,
    created="2026-01-01T00:00:00Z",
    versions={"paravol": "0"},
)
