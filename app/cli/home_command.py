"""`paravol home`: tell an arm that it stands in its rest."""

import sys
from collections.abc import Callable

from app.cli.root import Flag, Json
from app.cli.terminal import print_json, print_table
from system import UserError

PATIENCE_S = 5.0

ORDER = """\
An arm measures from its rest, and believes to stand there when it is told to home.
  1. Put it into the home position of the maker's manual. The base of a 3D or 3DX may
     be turned to any side; that of a G2 has a home position, too.
  2. Press the Home button of a G2 now; its red light flashes until then.
  3. Let it stand still.
Nothing is written into the arm; switching it off forgets it. A registration made
before is worth nothing afterwards."""


def home(*, device: str, yes: Flag = False, json: Json = False) -> int:
    """Home an arm that stands in its rest position.

    Asks before it does: an arm that is homed elsewhere measures wrongly without a
    word.

    Parameters
    ----------
    device
        Serial port of a MicroScribe, such as /dev/ttyUSB0.
    yes
        The arm is in its rest; do not ask.
    """
    from devices.microscribe import MicroScribe
    from devices.microscribe.driver.sampler import HomeState
    from devices.port import DeviceError, DeviceReason
    from paravol.inputs.open_arm import require_port

    require_port(device)
    print(ORDER, file=sys.stderr)
    if not (yes or confirmed(f"Is the arm on {device} in its rest? Home it? [y/N] ")):
        print("The arm was not homed.", file=sys.stderr)
        return 1
    with MicroScribe(device, assume_home=False) as arm:
        arm.home()
        pose = arm.read(PATIENCE_S)
        about = arm.description.identity
        if arm.home_state is not HomeState.HOMED:
            raise DeviceError(
                DeviceReason.NOT_HOMED,
                f"The arm on {device} lost its power meanwhile; begin again.",
            )
    tip = [round(float(value), 1) for value in pose.tip_mm]
    if json:
        print_json({"serial": about.serial, "homed": True, "tip_mm": tip})
        return 0
    print_table(
        "Homed",
        [
            ("arm", f"{about.product_name} {about.model}, {about.serial}"),
            ("tip at rest", f"{' '.join(map(str, tip))} mm in the arm's frame"),
            ("next", "`paravol register`: earlier registrations are void"),
        ],
    )
    return 0


def confirmed(question: str, answer: Callable[[], str] = input) -> bool:
    """Ask on standard error, take only a plain yes; UserError when nobody answers."""
    print(question, end="", file=sys.stderr, flush=True)
    try:
        return answer().strip().lower() in ("y", "yes")
    except EOFError:
        raise UserError(
            "Nobody answered whether the arm is in its rest; give --yes where nobody "
            "can."
        ) from None
