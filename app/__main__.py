"""The `paravol` command: start, errors, exit status."""

import sys

from app.environment import prepare_environment


def main(arguments: list[str] | None = None) -> int:
    """Run one command; give the exit status.

    0 only on success; 1 with one sentence on standard error when the input or the
    world is at fault; 2 for a command line that is not understood; 130 after Ctrl-C.
    Anything else is a defect of ours and shows its traceback.
    """
    prepare_environment()
    from app.commands import app
    from app.faults import EXPECTED, sentence

    try:
        outcome = app(arguments, exit_on_error=True, result_action="return_value")
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return 130
    except EXPECTED as error:
        print(f"paravol: {sentence(error)}", file=sys.stderr)
        return 1
    return outcome if isinstance(outcome, int) else 0


if __name__ == "__main__":
    raise SystemExit(main())
