"""The `paravol` command: start, errors, exit status."""

import sys

OVERVIEW: tuple[list[str], ...] = ([], ["--help"], ["-h"], ["help"])


def main(arguments: list[str] | None = None) -> int:
    """Run one command; give the exit status.

    0 only on success; 1 with one sentence on standard error when the input or the
    world is at fault; 2 for a command line that is not understood; 130 after Ctrl-C.
    Anything else is a defect of ours and shows its traceback; with --debug every error
    does.
    """
    from system.plain_text import plain_output

    with plain_output():
        return _told(list(sys.argv[1:] if arguments is None else arguments))


def _told(words: list[str]) -> int:
    """Run one command; tell what is wrong with it."""
    debug = "--debug" in words
    if debug:
        words.remove("--debug")
    if words in OVERVIEW:
        from app.cli.overview import overview

        print(overview(), end="")
        return 0
    try:
        return _run(words)
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return 130
    except Exception as error:
        from app.errors import sentence

        told = sentence(error)
        if told is None or debug:
            raise
        print(f"paravol: {told}", file=sys.stderr)
        return 1


def _run(words: list[str]) -> int:
    from paravol.environment import prepare_environment

    prepare_environment()
    from cyclopts import CycloptsError

    from app.cli.renamed_options import renamed_option
    from app.cli.root import app

    if renamed := renamed_option(words):
        print(f"paravol: {renamed} See paravol {words[0]} --help.", file=sys.stderr)
        return 2
    console = None
    if {"--help", "-h", "--version"} & {*words}:
        from rich.console import Console

        from system.plain_text import raw_stream

        # it writes commands of its own
        console = Console(file=raw_stream(sys.stdout))
    try:
        outcome = app(
            words,
            console=console,
            result_action="return_value",
            exit_on_error=False,
            print_error=False,
        )
    except CycloptsError as error:
        helps = " ".join(["paravol", *(error.command_chain or ()), "--help"])
        print(f"paravol: {error} See {helps}.", file=sys.stderr)
        return 2
    return outcome if isinstance(outcome, int) else 0


if __name__ == "__main__":
    raise SystemExit(main())
