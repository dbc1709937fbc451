"""The list of commands, printed at once.

``paravol --help`` is what a person types first. Loading the command-line library for
it takes ten times as long as parsing the source of the commands; and a command's own
module is loaded when it is asked for.
"""

import ast
from pathlib import Path

COMMANDS = {
    "Fly": (("demo", "demo"), ("train", "train"), ("scenario_command", "scenario")),
    "Patients": (
        ("import_command", "import_"),
        ("phantom_command", "phantom"),
        ("export_command", "export"),
        ("face_command", "face"),
        ("slices_command", "slices"),
        ("volume_command", "volume"),
    ),
    "Pictures": (("snapshot_options", "snapshot"), ("worker_command", "worker")),
    "Sessions": (
        ("replay_command", "replay"),
        ("metrics_command", "metrics"),
        ("coverage_command", "coverage"),
        ("debrief_command", "debrief"),
        ("score_command", "score"),
        ("score_command", "pass_mark"),
        ("annotate_command", "annotate"),
        ("unfinished_command", "unfinished"),
        ("progress_command", "progress"),
        ("exchange_command", "path"),
    ),
    "Devices": (
        ("emulator_command", "emulator"),
        ("home_command", "home"),
        ("register_command", "register"),
    ),
    "Machine": (
        ("tools_command", "tools"),
        ("doctor", "doctor"),
        ("desktop_entry", "desktop_entry"),
        ("bench_commands", "bench"),
    ),
}
"""By groups, the module and the function of every command, or its `App`."""


def command_name(function: str) -> str:
    """Return a command's name; a name that Python keeps for itself ends in ``_``."""
    return function.strip("_").replace("_", "-")


_HEAD = """Usage: paravol COMMAND [OPTIONS]

Endoscopic sinus surgery trainer: fly, replay, snapshot, measure.

"""

_FOOT = """
paravol COMMAND --help explains a command; paravol --version names the version;
--debug shows where an error was raised; --install-completion completes words in the
shell.
Start with: paravol demo
"""


def overview() -> str:
    """Return the help text: by groups, every command with its first line."""
    parts = []
    for group, commands in COMMANDS.items():
        rows = [
            f"  {command_name(function):<13} {_first_line(module, function)}"
            for module, function in commands
        ]
        parts.append("\n".join([f"{group}:", *sorted(rows)]))
    return _HEAD + "\n\n".join(parts) + "\n" + _FOOT


def _first_line(module: str, function: str) -> str:
    """Return what a command is for: of its docstring, or of an `App` its help."""
    source = Path(__file__).with_name(f"{module}.py").read_text(encoding="utf-8")
    for node in ast.parse(source).body:
        match node:
            case ast.FunctionDef(name=name) if name == function:
                return (ast.get_docstring(node) or "").partition("\n")[0]
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call() as made) if (
                name == function
            ):
                told = {word.arg: word.value for word in made.keywords}
                return str(ast.literal_eval(told["help"]))
    raise LookupError(f"{module} has no command {function}")
