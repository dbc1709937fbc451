"""What a registration says, as rows of a table."""

from devices.registration.registration_file import RegistrationRecord
from devices.registration.target_error import over_budget


def registration_rows(
    record: RegistrationRecord, true: dict[str, float] | None
) -> list[tuple[str, str]]:
    """Return names and texts: tip, residuals, expected errors, and the budget.

    true: the real errors at the targets, of an arm whose truth is known.
    """
    rows = []
    if record.pivot is not None:
        tip = " ".join(f"{value:.2f}" for value in record.tip_mm)
        rows.append(("tip", f"{tip} mm from the stated one"))
        error_mm, condition = record.pivot.error_mm, record.pivot.condition
        repeats = f"{error_mm:.2f} mm, condition {condition:.1f}"
        rows.append(("tip repeats to", repeats))
    rows += [
        (f"touched {mark.name}", f"residual {mark.residual_mm:.2f} mm")
        for mark in record.landmarks
    ]
    if record.traced_points:
        rows.append(
            (
                f"skin, {record.traced_points} points",
                f"{record.surface_rms_mm:.2f} mm rms",
            )
        )
    rows += _agreement(record)
    for name, error in record.targets.items():
        known = "" if true is None else f", truly {true[name]:.2f}"
        rows.append((f"expected at {name}", f"{error:.2f} mm rms{known}"))
    beyond = over_budget(record.targets, record.budget_mm)
    verdict = (
        f"over {record.budget_mm:g} mm: {', '.join(beyond)}"
        if beyond
        else f"all targets within {record.budget_mm:g} mm"
    )
    return [*rows, ("budget", verdict)]


def _agreement(record: RegistrationRecord) -> list[tuple[str, str]]:
    """Return how well the measurements agree, and what raised the expected errors."""
    agreement = record.agreement
    if agreement is None:
        return []
    rows = [
        (
            "landmarks fit to",
            f"{record.residual_rms_mm:.2f} mm rms; {agreement.chance:.0%} of sound "
            "registrations fit worse",
        )
    ]
    for what, ratio in (
        ("landmarks", agreement.landmarks_ratio),
        ("swing of the tip", agreement.constants_ratio),
    ):
        if ratio > 1.0:
            rows.append(
                (f"{what} worse", f"{ratio:.1f} times than expected; told errors grew")
            )
    return rows
