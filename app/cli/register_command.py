"""`paravol register`: lead a person through the registration of an arm."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from cyclopts import Parameter

from app.cli.root import Flag, Json, ScenarioName, Seed
from app.cli.terminal import ProgressReporter, print_json, print_table
from system import UserError

if TYPE_CHECKING:
    from devices.registration.registration_file import RegistrationRecord
    from paravol.registration.arm_registration import RegistrationOrder


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class RegisterOptions:
    """Options of a registration, as they were typed.

    Parameters
    ----------
    device
        Serial port of a MicroScribe, such as /dev/ttyUSB0, or socket://host:port.
    emulated
        Let an emulated arm go all the way by itself; its true errors are shown.
    out
        The .json file to write; a .tfm for ITK and 3D Slicer lands beside it.
    pivot
        Calibrate the tip first; --no-pivot takes the tip that the arm states.
    trace
        Refine on a traced patch of skin; --no-trace leaves the landmarks alone.
    target
        Landmark at which the error is shown; the sinuses when left out.
    seed
        Where the emulated arm stands and how its hand shakes.
    yes
        Write the file without asking.
    input
        Another tracker instead of an arm: igtl:HOST:PORT[:TOOL].
    """

    scenario: ScenarioName = "first_flight"
    device: str | None = None
    emulated: Flag = False
    out: Path = Path("registration.json")
    pivot: bool = True
    trace: bool = True
    target: tuple[str, ...] = ()
    seed: Seed = 1
    yes: Flag = False
    input: str | None = None


def register(
    *, options: RegisterOptions = RegisterOptions(), json: Json = False
) -> int:
    """Register an arm: turn the tip, touch the landmarks, trace the skin."""
    from paravol.registration.arm_registration import register_arm

    _check(options)
    asks_later = not options.yes and _at_terminal()
    if not (options.yes or asks_later or _confirmed(options.out)):
        return 1
    if options.input is not None:
        record = _tracked(options)
        return _finish(options, record, None, asks=asks_later, as_json=json)
    with ProgressReporter() as guide:
        found = register_arm(_order(options), guide)
    return _finish(options, found.record, found.true_mm, asks=asks_later, as_json=json)


def _order(options: RegisterOptions) -> "RegistrationOrder":
    from paravol.registration.arm_registration import RegistrationOrder

    return RegistrationOrder(
        options.scenario,
        options.device,
        options.pivot,
        options.trace,
        options.target,
        options.seed,
    )


def _tracked(options: RegisterOptions) -> "RegistrationRecord":
    """Register a tracker by its landmarks alone; what is typed stands for pedals."""
    from devices.openigtlink import OpenIGTLinkSource
    from paravol.inputs.typed_pedals import HELP, TypedPedals
    from paravol.registration.arm_registration import plan_registration, warn_of_plan
    from paravol.registration.tracker import register_tracker

    address = _tracker(options.input or "")
    with ProgressReporter() as guide:
        # Of a tracker nobody knows how its errors follow a traced patch.
        plan = plan_registration(replace(_order(options), trace=False), guide)
        warn_of_plan(plan, guide)
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
    from paravol.inputs.igtl import peer_address

    kind, _, rest = words.partition(":")
    if kind != "igtl":
        raise UserError(f"--input must be igtl:HOST:PORT[:TOOL]; got {words!r}.")
    return peer_address("--input", rest)


def _finish(
    options: RegisterOptions,
    record: "RegistrationRecord",
    true: dict[str, float] | None,
    *,
    asks: bool,
    as_json: bool,
) -> int:
    """Show a registration and write it, unless the person does not want it written."""
    import numpy as np

    from devices.registration.registration_file import (
        save_itk_transform,
        save_registration,
    )
    from paravol.registration.record_rows import registration_rows

    if as_json:
        print_json(_summary(options, record, true))
    else:
        print_table("Registration", registration_rows(record, true))
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
    from paravol.inputs.open_arm import require_port
    from scenarios import load_scenario

    ways = (options.emulated, options.device is not None, options.input is not None)
    if sum(ways) != 1:
        raise UserError(
            "Give either --device with the arm's port, --emulated or --input with "
            "another tracker."
        )
    if options.input is not None:
        _tracker(options.input)
    require_port(options.device)
    if options.out.suffix != ".json":
        raise UserError(f"--out must name a .json file, got {options.out}.")
    if not options.out.absolute().parent.is_dir():
        raise UserError(f"There is no folder {options.out.absolute().parent}.")
    load_scenario(options.scenario)


def _summary(
    options: RegisterOptions,
    record: "RegistrationRecord",
    true: dict[str, float] | None,
) -> dict[str, Any]:
    return {
        "file": str(options.out),
        "transform": str(options.out.with_suffix(".tfm")),
        "within_budget": record.within_budget,
        "true_targets": true,
        **msgspec.to_builtins(record),
    }


def _at_terminal() -> bool:
    # there is none at all where a program was started without
    return sys.stdin is not None and sys.stdin.isatty()


def _confirmed(out: Path) -> bool:
    # Asked on standard error, so that --json leaves standard output to the result.
    print(f"Write {out}? [Y/n] ", end="", file=sys.stderr, flush=True)
    try:
        return input().strip().lower() in ("", "y", "yes")
    except (EOFError, RuntimeError):
        raise UserError(
            "Nobody answered whether to write the file; give --yes where nobody can."
        ) from None
