"""Register an arm, real or emulated: plan, walk, fit; whoever guides shows the way."""

import threading
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.microscribe import MicroScribe
from devices.microscribe.kinematics.uncertainty import ParameterSpread
from devices.registration.registration_file import RegistrationRecord
from devices.registration.rehearsal import rehearse
from devices.registration.rigid_fit import closest_other_order
from devices.registration.target_error import fitzpatrick_rms_mm, refuse_weak_targets
from paravol.inputs.open_arm import arm_at
from paravol.inputs.pose_sources import CancellableSource, HomedSource
from paravol.patient import load_patient
from paravol.registration.at_start import head_of
from paravol.registration.fit import (
    DENT_MM,
    Touched,
    describe_registration,
    fit_registration,
)
from paravol.registration.rehearsed_arm import (
    RehearsedTruth,
    rehearsed_arm,
    rehearsed_truth,
)
from paravol.registration.skin import Skin
from paravol.registration.walk import Guide, RegistrationWalk
from scenarios import load_scenario
from system import UserError

SINUSES = ("maxillary ostium", "ethmoid bulla", "frontal ostium", "sphenoid ostium")

PLANNED_MM = 0.5
"""Error of a touch, rms, when nothing is known of the arm yet."""

ALIKE_MM = 3.0
"""Landmarks that fit each other's places this well can be exchanged unnoticed."""


@dataclass(frozen=True, slots=True)
class RegistrationOrder:
    """What is to be registered.

    port: of the arm; None for the emulated one, which goes through it by itself. pivot:
    the tip is calibrated first. trace: a patch of skin is drawn over at the end.
    targets: landmarks where the error matters, none for the sinuses' openings. seed: of
    the emulated arm's errors.
    """

    scenario: str
    port: str | None = None
    pivot: bool = True
    trace: bool = True
    targets: tuple[str, ...] = ()
    seed: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class RegistrationPlan:
    """What is to be touched, and where the answer matters; ``(3,)`` LPS mm."""

    head: str
    landmarks: dict[str, NDArray[np.float64]]
    targets: dict[str, NDArray[np.float64]]
    skin: Skin | None


@dataclass(frozen=True, slots=True)
class Registered:
    """What came of it. true_mm: real errors at the targets of an emulated arm."""

    record: RegistrationRecord
    true_mm: dict[str, float] | None


def register_arm(
    order: RegistrationOrder, guide: Guide, closed: threading.Event | None = None
) -> Registered:
    """Lead somebody through a registration.

    closed: ends it at the next pose, by ClosedError. Raises UserError for bad input,
    RegistrationError, PivotError or HoldError for measurements that cannot be trusted,
    the device's error when the arm fails.
    """
    with ExitStack() as stack:
        plan = plan_registration(order, guide)
        warn_of_plan(plan, guide)
        guide("Opening the arm", 0.0)
        arm, truth = stack.enter_context(_opened(order, plan))
        guide("Opening the arm", 1.0)
        description = arm.description
        poses = CancellableSource(HomedSource(arm), closed or threading.Event())
        walk = RegistrationWalk(poses, guide)
        five_joints = description.maxima.encoders[5] == 0
        pivot = walk.pivot(along_axis=five_joints) if order.pivot else None
        held = walk.touch(list(plan.landmarks))
        traced = np.zeros((0, 3)) if plan.skin is None else walk.trace()
        touched = Touched(held, traced, pivot)
        identity = description.identity
        spread = ParameterSpread.of_model(identity.model)
        fit = fit_registration(
            touched, plan.landmarks, plan.skin, plan.targets, description, spread
        )
        record = describe_registration(
            fit,
            touched,
            plan.landmarks,
            serial=identity.serial,
            model=identity.model,
            head=plan.head,
        )
    true = None if truth is None else truth.errors_mm(record, plan.targets)
    return Registered(record, true)


def plan_registration(order: RegistrationOrder, guide: Guide) -> RegistrationPlan:
    """Load the head and say what is to be touched."""
    scenario, _ = load_scenario(order.scenario)
    room = load_patient(scenario, guide)
    names = order.targets or sinus_targets(room.landmarks)
    return RegistrationPlan(
        head=head_of(scenario),
        landmarks=scenario.fiducial_positions(),
        targets=room.positions(names),
        skin=Skin(room.surface.distance) if order.trace else None,
    )


def sinus_targets(landmarks: Collection[str]) -> tuple[str, ...]:
    """Return the names of the sinus openings that a head has; some may be lacking.

    Raises UserError where it has none of them.
    """
    names = [f"{sinus}, {side}" for sinus in SINUSES for side in ("right", "left")]
    found = tuple(name for name in names if name in landmarks)
    if not found:
        raise UserError(
            f"The head has no landmark {names[0]!r} or another sinus; name targets "
            f"with --target. It has: {'; '.join(sorted(landmarks))}."
        )
    return found


def warn_of_plan(plan: RegistrationPlan, guide: Guide) -> None:
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
def _opened(
    order: RegistrationOrder, plan: RegistrationPlan
) -> Iterator[tuple[MicroScribe, RehearsedTruth | None]]:
    if order.port is not None:
        with arm_at(order.port) as arm:
            yield arm, None
        return
    points = np.stack(list(plan.landmarks.values()))
    path = rehearse(
        points,
        pivot_mm=points[0] if order.pivot else None,
        traced_mm=None if plan.skin is None else plan.skin.raster(DENT_MM),
        seed=order.seed,
    )
    truth = rehearsed_truth(path, ParameterSpread(), order.seed)
    with rehearsed_arm(truth, path) as arm:
        yield arm, truth
