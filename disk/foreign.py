"""Bytes that somebody else wrote: whatever they do to a reader becomes a sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def reading(file: Path | str) -> Iterator[None]:
    """Turn any exception of a library that reads `file` into a ValueError naming it.

    A ValueError that names the file already is a sentence and passes as it is.
    """
    try:
        yield
    except (NameError, ImportError):
        raise  # no bytes do that: the program is at fault
    except Exception as error:
        if isinstance(error, ValueError) and str(file) in str(error):
            raise
        told = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{file} is damaged or cannot be read: {told}") from error
