"""`paravol register`: lead a person through the registration of an arm."""

import sys
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from app.cli.terminal import Stages, print_json, print_table
from devices.microscribe import MicroScribe
from devices.microscribe.kinematics.uncertainty import ParameterSpread
from devices.registration.registration_file import (
    RegistrationRecord,
    save_itk_transform,
    save_registration,
)
from devices.registration.rehearsal import rehearse
from devices.registration.rigid_fit import closest_other_order
from devices.registration.target_error import (
    fitzpatrick_rms_mm,
    over_budget,
    refuse_weak_targets,
)
from disk import UserError
from paravol.inputs.input_choice import peer_address
from paravol.inputs.open_arm import arm_at, demand_port
from paravol.inputs.pose_sources import HomedSource
from paravol.inputs.typed_pedals import HELP, TypedPedals
from paravol.patient import load_patient
from paravol.registration.at_start import head_of
from paravol.registration.fit import Touched, describe_registration, fit_registration
from paravol.registration.rehearsed_arm import (
    RehearsedTruth,
    rehearsed_arm,
    rehearsed_truth,
)
from paravol.registration.skin import Skin
from paravol.registration.tracker import register_tracker
from paravol.registration.walk import RegistrationWalk
from scenarios import load_scenario

SINUSES = ("maxillary ostium", "ethmoid bulla", "frontal ostium", "sphenoid ostium")

PLANNED_MM = 0.5
"""Error of a touch, rms, when nothing is known of the arm yet."""

ALIKE_MM = 3.0
"""Landmarks that fit each other's places this well can be exchanged unnoticed."""


@dataclass(frozen=True, slots=True)
class RegisterOptions:
    """Options of `paravol register`, as they were typed."""

    scenario: str
    device: str | None
    emulated: bool
    out: Path
    pivot: bool
    trace: bool
    targets: tuple[str, ...]
    yes: bool
    seed: int
    input: str | None = None
    """Another tracker instead of an arm: igtl:HOST:PORT[:TOOL]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """What is to be touched and where the answer matters."""

    head: str
    landmarks: dict[str, NDArray[np.float64]]
    targets: dict[str, NDArray[np.float64]]
    skin: Skin | None


def run_register(options: RegisterOptions, *, as_json: bool) -> int:
    """Register and write the file; 1 when the person does not want it written.

    A person at a terminal is asked when the figures are there; where standard input is
    none, what it says is read before anything slow begins.

    Nothing is written before the end, so that Ctrl-C leaves nothing. ValueError for
    bad input, RegistrationError, PivotError or HoldError for measurements that cannot
    be trusted, the device's error when the arm fails.
    """
    _check(options)
    asks_later = not options.yes and _at_terminal()
    if not (options.yes or asks_later or _confirmed(options.out)):
        return 1
    if options.input is not None:
        record = _tracked(options)
        return _finish(options, record, None, asks=asks_later, as_json=as_json)
    with Stages() as guide, ExitStack() as stack:
        plan = _plan(options, guide)
        _warn_of_plan(plan, guide)
        guide("Opening the arm", 0.0)
        arm, truth = stack.enter_context(_open(options, plan))
        guide("Opening the arm", 1.0)
        spread = ParameterSpread.of_model(arm.description.identity.model)
        walk = RegistrationWalk(HomedSource(arm), guide)
        five_joints = arm.description.maxima.encoders[5] == 0
        pivot = walk.pivot(along_axis=five_joints) if options.pivot else None
        held = walk.touch(list(plan.landmarks))
        traced = np.zeros((0, 3)) if plan.skin is None else walk.trace()
        touched = Touched(held, traced, pivot)
        description = arm.description
        fit = fit_registration(
            touched, plan.landmarks, plan.skin, plan.targets, description, spread
        )
        record = describe_registration(
            fit,
            touched,
            plan.landmarks,
            serial=description.identity.serial,
            model=description.identity.model,
            head=plan.head,
        )
    true = None if truth is None else truth.errors_mm(record, plan.targets)
    return _finish(options, record, true, asks=asks_later, as_json=as_json)


def _tracked(options: RegisterOptions) -> RegistrationRecord:
    """Register a tracker by its landmarks alone; what is typed stands for pedals."""
    from devices.openigtlink import OpenIGTLinkSource

    address = _tracker(options.input or "")
    with Stages() as guide:
        # Of a tracker nobody knows how its errors follow a traced patch.
        plan = _plan(replace(options, trace=False), guide)
        _warn_of_plan(plan, guide)
        with OpenIGTLinkSource(*address) as source:
            guide.say(HELP)
            return register_tracker(
                TypedPedals(source),
                guide,
                plan.landmarks,
                plan.targets,
                pivot=options.pivot,
                head=plan.head,
                tool=lambda: source.tool,
            )


def _tracker(words: str) -> tuple[str, int, str | None]:
    kind, _, rest = words.partition(":")
    if kind != "igtl":
        raise UserError(f"--input must be igtl:HOST:PORT[:TOOL]; got {words!r}.")
    return peer_address("--input", rest)


def _finish(
    options: RegisterOptions,
    record: RegistrationRecord,
    true: dict[str, float] | None,
    *,
    asks: bool,
    as_json: bool,
) -> int:
    """Show a registration and write it, unless the person does not want it written."""
    if as_json:
        print_json(_summary(options, record, true))
    else:
        print_table("Registration", _rows(record, true))
    if asks and not _confirmed(options.out):
        return 1
    save_itk_transform(
        options.out.with_suffix(".tfm"),
        np.array(record.world_from_device).reshape(4, 4),
    )
    save_registration(options.out, record)
    return 0


def _check(options: RegisterOptions) -> None:
    """Refuse bad options before anybody has touched anything."""
    ways = (options.emulated, options.device is not None, options.input is not None)
    if sum(ways) != 1:
        raise UserError(
            "Give either --device with the arm's port, --emulated or --input with "
            "another tracker."
        )
    if options.input is not None:
        _tracker(options.input)
    demand_port(options.device)
    if options.out.suffix != ".json":
        raise UserError(f"--out must name a .json file, got {options.out}.")
    if not options.out.absolute().parent.is_dir():
        raise UserError(f"There is no folder {options.out.absolute().parent}.")
    load_scenario(options.scenario)


def _plan(options: RegisterOptions, guide: Stages) -> _Plan:
    scenario, _ = load_scenario(options.scenario)
    room = load_patient(scenario, guide)
    names = options.targets or sinus_targets(room.landmarks)
    return _Plan(
        head=head_of(scenario),
        landmarks=scenario.fiducial_positions(),
        targets=room.positions(names),
        skin=Skin(room.surface.distance) if options.trace else None,
    )


def sinus_targets(landmarks: Collection[str]) -> tuple[str, ...]:
    """Return the names of the sinus openings that a head has; some may be lacking.

    Raises ValueError where it has none of them.
    """
    names = [f"{sinus}, {side}" for sinus in SINUSES for side in ("right", "left")]
    found = tuple(name for name in names if name in landmarks)
    if not found:
        raise UserError(
            f"The head has no landmark {names[0]!r} or another sinus; name targets "
            f"with --target. It has: {'; '.join(sorted(landmarks))}."
        )
    return found


def _warn_of_plan(plan: _Plan, guide: Stages) -> None:
    """Refuse landmarks that cannot serve the targets, warn of those too alike."""
    points = np.stack(list(plan.landmarks.values()))
    planned = fitzpatrick_rms_mm(
        points, np.stack(list(plan.targets.values())), PLANNED_MM
    )
    if plan.skin is None:
        refuse_weak_targets(dict(zip(plan.targets, planned.tolist(), strict=True)))
    if len(points) <= 7:
        order, residual = closest_other_order(points)
        if residual < ALIKE_MM:
            alike = [n for i, n in enumerate(plan.landmarks) if order[i] != i]
            guide.say(
                f"Take care of the order: {', '.join(alike)} lie so alike that an "
                f"exchange would leave {residual:.1f} mm only."
            )


@contextmanager
def _open(
    options: RegisterOptions, plan: _Plan
) -> Iterator[tuple[MicroScribe, RehearsedTruth | None]]:
    if options.device is not None:
        with arm_at(options.device) as arm:
            yield arm, None
        return
    points = np.stack(list(plan.landmarks.values()))
    path = rehearse(
        points,
        pivot_mm=points[0] if options.pivot else None,
        traced_mm=None if plan.skin is None else plan.skin.raster(),
        seed=options.seed,
    )
    truth = rehearsed_truth(path, ParameterSpread(), options.seed)
    with rehearsed_arm(truth, path) as arm:
        yield arm, truth


def _summary(
    options: RegisterOptions, record: RegistrationRecord, true: dict[str, float] | None
) -> dict[str, Any]:
    return {
        "file": str(options.out),
        "transform": str(options.out.with_suffix(".tfm")),
        "within_budget": record.within_budget,
        "true_targets": true,
        **msgspec.to_builtins(record),
    }


def _rows(
    record: RegistrationRecord, true: dict[str, float] | None
) -> list[tuple[str, str]]:
    rows = []
    if record.pivot is not None:
        tip = " ".join(f"{value:.2f}" for value in record.tip_mm)
        rows.append(("tip", f"{tip} mm from the stated one"))
        repeats = f"{record.pivot.error_mm:.2f} mm, condition"
        rows.append(("tip repeats to", f"{repeats} {record.pivot.condition:.1f}"))
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


def _at_terminal() -> bool:
    # there is none at all where a program was started without
    return sys.stdin is not None and sys.stdin.isatty()


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


def _confirmed(out: Path) -> bool:
    # Asked on standard error, so that --json leaves standard output to the result.
    print(f"Write {out}? [Y/n] ", end="", file=sys.stderr, flush=True)
    try:
        return input().strip().lower() in ("", "y", "yes")
    except (EOFError, RuntimeError):
        raise UserError(
            "Nobody answered whether to write the file; give --yes where nobody can."
        ) from None
