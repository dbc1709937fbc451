"""Numbers with a decimal point for foreign libraries, wherever the user lives."""

import locale


def use_c_numbers() -> None:
    """Let C libraries read and write numbers with a point from now on.

    Python starts so, but Qt brings the process to the user's locale once its
    application is made. Where that has a comma, libraries that use C's functions take
    the 1.5 of a file for 1, and write 1,5. It is never put back: nothing of ours wants
    a comma, and no thread is caught in between.
    """
    if locale.setlocale(locale.LC_NUMERIC) != "C":
        locale.setlocale(locale.LC_NUMERIC, "C")
