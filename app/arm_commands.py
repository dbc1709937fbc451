"""Commands that tell a real arm something.

As in app/commands.py, nothing heavy is imported before a command runs.
"""

from app.root import Flag, Json, app


@app.command
def home(*, device: str, yes: Flag = False, json: Json = False) -> int:
    """Tell an arm that stands in its rest to measure from there.

    Asks before it does: an arm that is homed elsewhere measures wrongly without a
    word.

    Parameters
    ----------
    device
        Serial port of a MicroScribe, such as /dev/ttyUSB0.
    yes
        The arm is in its rest; do not ask.
    """
    from app.home_command import run_home

    return run_home(device, yes=yes, as_json=json)
