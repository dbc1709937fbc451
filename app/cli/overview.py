"""The list of commands, printed at once.

``paravol --help`` is what a person types first. Loading the command-line library for
it takes ten times as long as parsing the source of the commands.
"""

import ast
from pathlib import Path

FILES = (
    "commands.py",
    "arm_commands.py",
    "bench_commands.py",
    "case_commands.py",
    "picture_commands.py",
    "progress_commands.py",
    "scenario_commands.py",
    "session_commands.py",
    "teaching_commands.py",
)

GROUPS = ("FLY", "PATIENTS", "PICTURES", "SESSIONS", "DEVICES", "MACHINE")
"""Names of the groups in `app.cli.root`, in their order."""

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
    rows: dict[str, list[str]] = {group: [] for group in GROUPS}
    for file in FILES:
        source = Path(__file__).with_name(file).read_text(encoding="utf-8")
        for node in ast.parse(source).body:
            if isinstance(node, ast.Assign) and ast.unparse(node.value).startswith(
                "App("
            ):
                # a command with commands of its own
                assert isinstance(node.value, ast.Call)
                words = _words(node.value)
                rows[words["group"]].append(f"  {words['name']:<13} {words['help']}")
            if _is_command(node):
                assert isinstance(node, ast.FunctionDef)
                first = (ast.get_docstring(node) or "").partition("\n")[0]
                words = _decorator_words(node)
                name = words.get("name", node.name.replace("_", "-"))
                rows[words["group"]].append(f"  {name:<13} {first}")
    parts = ["\n".join([f"{group.title()}:", *sorted(rows[group])]) for group in GROUPS]
    return _HEAD + "\n\n".join(parts) + "\n" + _FOOT


def _is_command(node: ast.stmt) -> bool:
    """Return whether a statement defines a command of the program itself."""
    return isinstance(node, ast.FunctionDef) and any(
        ast.unparse(decorator).startswith("app.command")
        for decorator in node.decorator_list
    )


def _decorator_words(node: ast.FunctionDef) -> dict[str, str]:
    """Return the command's group, and its name where that cannot be a function's."""
    (decorator,) = node.decorator_list
    assert isinstance(decorator, ast.Call)
    return _words(decorator)


def _words(call: ast.Call) -> dict[str, str]:
    """Return a call's keywords as text; strings that stand in parts are joined."""
    return {
        str(k.arg): k.value.value
        if isinstance(k.value, ast.Constant) and isinstance(k.value.value, str)
        else ast.unparse(k.value)
        for k in call.keywords
    }
