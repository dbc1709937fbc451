"""Thresholds and filters of the metrics, as data that a file can change."""

from pathlib import Path

import msgspec

from system import UserError
from system.typed_record import decode_toml

_ABOVE_ZERO = (
    *("gap_s", "rate_hz", "cutoff_hz", "idle_mm_s", "onset_mm_s", "rest_mm_s"),
    *("action_mm_s", "action_deg_s", "centred_deg", "margin_mm", "stiffness_n_mm"),
    "swept_length_mm",
)


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the metrics take as given; the figures' sources are in docs/metrics.md.

    gap_s: longer than this between two samples, the tool was away. rate_hz, cutoff_hz,
    filter_order: tracks are resampled to this rate and low-passed by a Butterworth
    filter, forwards and backwards.
    idle_mm_s, idle_s: slower than this for so long is idle. onset_mm_s, rest_mm_s,
    movement_s: a movement begins above the first speed, ends below the second and lasts
    at least so long. action_mm_s, action_deg_s, action_s: of PerkTutor's actions.
    peak_mm_s: speeds whose peaks are counted.
    centred_deg: half angle of the cone in which a target is centred. attended_mm: a
    target farther away is not looked at. near_mm, far_mm: the working distance.
    contact_close_mm: gap beyond which a contact is over. stiffness_n_mm: newtons a
    millimetre of depth, nominal. margin_mm: kept from hazards; margins_mm: of single
    ones. largest_condition: of a pivot that is still told. wanted_mm3, protected_mm3:
    tissue that a task wants taken, and that it wants spared with how much of it there
    is. swept_length_mm: of the shaft's end whose swept volume is counted.
    """

    gap_s: float = 0.5
    rate_hz: float = 100.0
    cutoff_hz: float = 6.0
    filter_order: int = 2
    idle_mm_s: float = 5.0
    idle_s: float = 0.5
    onset_mm_s: float = 10.0
    rest_mm_s: float = 5.0
    movement_s: float = 0.2
    action_mm_s: float = 50.0
    action_deg_s: float = 50.0
    action_s: float = 0.2
    peak_mm_s: tuple[float, ...] = (20.0, 50.0, 100.0)
    centred_deg: float = 12.5
    attended_mm: float = 40.0
    near_mm: float = 5.0
    far_mm: float = 20.0
    contact_close_mm: float = 0.2
    stiffness_n_mm: float = 1.0
    margin_mm: float = 3.0
    margins_mm: dict[str, float] = {}  # msgspec copies it for each record
    largest_condition: float = 1000.0
    wanted_mm3: dict[str, float] = {}
    protected_mm3: dict[str, float] = {}
    swept_length_mm: float = 30.0

    def margin_of(self, hazard: str) -> float:
        """Return the margin of one hazard, mm."""
        return self.margins_mm.get(hazard, self.margin_mm)


def load_settings(file: Path) -> Settings:
    """Read a TOML file of thresholds; UserError names what is wrong in it."""
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UserError(
            f"The metrics' settings {file} cannot be read: {error.strerror}."
        ) from error
    settings = decode_toml(content, Settings, file, "settings of metrics")
    named = {name: getattr(settings, name) for name in _ABOVE_ZERO}
    named |= {f"margins_mm.{name}": mm for name, mm in settings.margins_mm.items()}
    for name, value in named.items():
        if not 0.0 < value < 1e6:
            raise UserError(f"{file}: {name} must be above 0, got {value:g}.")
    if not settings.cutoff_hz < settings.rate_hz / 2:
        raise UserError(
            f"{file}: cutoff_hz must be below half of rate_hz, got "
            f"{settings.cutoff_hz:g} of {settings.rate_hz:g}."
        )
    if not 1 <= settings.filter_order <= 8:
        raise UserError(
            f"{file}: filter_order must lie between 1 and 8, got "
            f"{settings.filter_order}."
        )
    if settings.rest_mm_s > settings.onset_mm_s:
        raise UserError(f"{file}: rest_mm_s must not be above onset_mm_s.")
    return settings
