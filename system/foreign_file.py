"""The one rule for files that others wrote: any failure to parse is one sentence.

A parser meets bytes that its author did not think of, and raises what it likes:
numpy's reader of array headers a `tokenize.TokenError`, ITK a `RuntimeError`, zipfile a
`BadZipFile`. Whoever reads a foreign file does so inside `foreign_file`.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from system.user_error import UserError

LONGEST = 200
"""Characters of a library's complaint that a sentence repeats."""


class ForeignFileError(UserError):
    """A file cannot be read as what it should be; the text is a sentence naming it."""


@contextmanager
def foreign_file(file: Path | str, what: str) -> Iterator[None]:
    """Turn whatever a library raises inside into a ForeignFileError.

    file: what is read. what: the kind of file, with its article: ``"a probe path"``.
    The library's exception stays as the cause. Errors of the operating system, such as
    a file that is not there, pass as they are, and so does a UserError that says what
    is wrong with the file by its name.
    """
    try:
        yield
    except (ForeignFileError, ImportError):
        raise
    except MemoryError as error:
        raise ForeignFileError(
            f"{file} cannot be read as {what}: it asks for more memory than there is."
        ) from error
    except Exception as error:
        if isinstance(error, OSError) and error.strerror:
            raise
        # A name that is missing is no file's fault, but a variable that a library has
        # not set yet is: trimesh meets it in a damaged PLY.
        if isinstance(error, NameError) and not isinstance(error, UnboundLocalError):
            raise
        if isinstance(error, UserError) and str(file) in str(error):
            raise  # our own sentence about this file
        raise ForeignFileError(
            f"{file} cannot be read as {what}: {_reason(error)}."
        ) from error


def _reason(error: Exception) -> str:
    """Put a library's complaint into the rest of a sentence."""
    said = str(error).strip()
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    if isinstance(error, KeyError):
        return f"it has no {said}"
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is no {error.encoding.upper()} text"
    # our own parsers say what is wrong in words, a library says what broke in it
    if isinstance(error, UserError) and lines:
        return lines[0][:LONGEST].rstrip(". ")
    detail = f" ({lines[-1][:LONGEST].rstrip('. ')})" if lines else ""
    return f"it is damaged, cut off or something else{detail}"
