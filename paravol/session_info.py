"""The description that is recorded with a session before its first sample."""

import datetime

import msgspec

from devices import Registration
from paravol.patient import OperatingRoom
from paravol.versions import versions
from renderers.shading import LOOK_VERSION
from scenarios import Scenario
from scenarios.bundle import SessionInfo

SEED = 1
"""Of the tissue's fine detail: the same patient looks the same in every session."""

LIVE_TIER = "LIVE"


def describe_session(
    scenario: Scenario,
    room: OperatingRoom,
    registration: Registration,
    *,
    size: int,
    has_instrument: bool,
) -> SessionInfo:
    """Gather what a replay needs to know."""
    return SessionInfo(
        scenario_name=scenario.name,
        scenario=msgspec.json.encode(scenario).decode(),
        picture_size=(size, size),
        tier=LIVE_TIER,
        seed=SEED,
        world_from_device=registration.world_from_device.ravel().tolist(),
        registration_rms_mm=registration.residual_rms_mm,
        surface_sha256=room.surface_sha256,
        has_instrument=has_instrument,
        created=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        versions=versions(),
        look=LOOK_VERSION,
        structures_sha256="" if room.structures is None else room.structures.sha256(),
    )
