"""Options that have a new name: the old one is refused, and the new one named."""

RENAMED = {
    ("snapshot", "--path"): "--camera-path",
    ("snapshot", "--paths"): "--path-samples",
    ("snapshot", "--truth"): "--path-traced",
    ("emulator", "--path"): "--probe-path",
}
"""The new name of a command's option."""


def renamed_option(words: list[str]) -> str | None:
    """Return a sentence on the first old name in a command line, None without one."""
    for word in words[1:]:
        name = word.partition("=")[0]
        if (words[0], name) in RENAMED:
            return f"{name} is called {RENAMED[words[0], name]} now."
    return None
