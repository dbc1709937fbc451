"""`paravol desktop-entry`: PARAVOL among the user's applications, and out again.

By freedesktop.org's Desktop Entry Specification 1.5 and its icon theme: one file each
below the user's data directory. Nothing outside it is touched.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import platformdirs

from app.cli.root import Flag
from system import UserError, whole_file

NAME = "paravol"
ICON = Path(__file__).with_name("paravol.svg")

_RESERVED = frozenset(" \t\n\"'\\><~|&;$*?#()`")
_PATIENCE_S = 20.0


def desktop_entry(*, remove: Flag = False) -> int:
    """Put PARAVOL among the desktop's applications, with an icon.

    Parameters
    ----------
    remove
        Remove it from there.
    """
    if not sys.platform.startswith("linux"):
        raise UserError(
            "Desktop entries are for Linux desktops; start paravol train in a "
            "terminal, or make a shortcut to it by hand."
        )
    data = Path(os.environ.get("XDG_DATA_HOME") or platformdirs.user_data_path())
    entry = data / "applications" / f"{NAME}.desktop"
    icon = data / "icons" / "hicolor" / "scalable" / "apps" / f"{NAME}.svg"
    if remove:
        for file in (entry, icon):
            file.unlink(missing_ok=True)
        print(f"Removed {entry} and its icon.")
        return 0
    with whole_file(icon) as beside:
        shutil.copyfile(ICON, beside)
    with whole_file(entry) as beside:
        beside.write_text(entry_text(command(), icon), "utf-8")
        _require_valid(beside)
    print(f"Wrote {entry}; the desktop shows PARAVOL among its applications.")
    return 0


def command() -> list[str]:
    """Return the words that start the window, wherever one starts them."""
    beside = Path(sys.executable).with_name("paravol")
    if beside.is_file():
        return [str(beside), "train"]
    return [sys.executable, "-m", "app", "train"]


def entry_text(words: list[str], icon: Path) -> str:
    """Return the file's text.

    words: the command. icon: file of the picture; an absolute path, which the
    specification allows, is found before the desktop has looked through its themes.
    """
    return "\n".join(
        (
            "[Desktop Entry]",
            "Type=Application",
            "Version=1.5",
            "Name=PARAVOL",
            "GenericName=Sinus surgery trainer",
            "Comment=Fly an endoscope through a virtual nose, and operate",
            f"Exec={' '.join(quoted(word) for word in words)}",
            f"Icon={_escaped(str(icon))}",
            "Terminal=false",
            "Categories=Education;MedicalSoftware;Science;",
            "Keywords=endoscope;sinus;surgery;training;",
            "StartupNotify=true",
            "",
        )
    )


def quoted(word: str) -> str:
    """Return a word of a command as the key Exec has it.

    By the specification's chapter on Exec: a word with a reserved character stands in
    double quotes, in which four characters are escaped; per cent is doubled; and then
    backslashes are escaped once more, as in every string. UserError for a line break,
    which cannot be written there.
    """
    if "\n" in word or "\r" in word:
        raise UserError(f"A desktop entry cannot start {word!r}: it has a line break.")
    if _RESERVED & set(word) or not word:
        inner = "".join(f"\\{c}" if c in '"`$\\' else c for c in word)
        word = f'"{inner}"'
    return _escaped(word.replace("%", "%%"))


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\")


def _require_valid(entry: Path) -> None:
    """Let the desktop's own tool read the entry, where it is installed."""
    tool = shutil.which("desktop-file-validate")
    if tool is None:
        return
    # it goes by the ending
    trial = entry.with_name(f"{entry.name}.trial.desktop")
    shutil.copyfile(entry, trial)
    try:
        done = subprocess.run(
            [tool, str(trial)], capture_output=True, text=True, timeout=_PATIENCE_S
        )
    finally:
        trial.unlink()
    if done.returncode != 0:
        said = (done.stdout + done.stderr).strip().splitlines()
        raise UserError(f"The desktop refuses the entry: {' '.join(said)}")
