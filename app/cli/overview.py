"""The list of commands, printed at once.

``paravol --help`` is what a person types first. Loading the command-line library for
it takes ten times as long as parsing the source of the commands.
"""

import ast
from pathlib import Path

FILES = ("commands.py", "arm_commands.py", "case_commands.py", "picture_commands.py")

_HEAD = """Usage: paravol COMMAND [OPTIONS]

Endoscopic sinus surgery trainer: fly, replay, snapshot, measure.

Commands:
"""

_FOOT = """
paravol COMMAND --help explains a command; paravol --version names the version;
--debug shows where an error was raised.
Start with: paravol demo
"""


def overview() -> str:
    """Give the help text: every command with the first line of its docstring."""
    rows = []
    for file in FILES:
        source = Path(__file__).with_name(file).read_text(encoding="utf-8")
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef) and node.decorator_list:
                first = (ast.get_docstring(node) or "").partition("\n")[0]
                rows.append(f"  {_name(node):<10} {first}")
    return _HEAD + "\n".join(sorted(rows)) + "\n" + _FOOT


def _name(node: ast.FunctionDef) -> str:
    """Give the command's name: "import" cannot be a function's."""
    for decorator in node.decorator_list:
        if isinstance(decorator, ast.Call):
            for keyword in decorator.keywords:
                if keyword.arg == "name" and isinstance(keyword.value, ast.Constant):
                    return str(keyword.value.value)
    return node.name
