"""Which errors are the world's and how they are told to a person."""

import msgspec

EXPECTED: tuple[type[Exception], ...] = (ValueError, OSError)
"""Families whose text is written for a person. Errors of the device and of the
snapshot service derive from `RuntimeError` families of their own and are added where
they are known, because importing them here would cost every command their modules."""


def sentence(error: Exception) -> str:
    """Put an expected error into one clear sentence."""
    if isinstance(error, msgspec.ValidationError):
        return f"The input is not valid: {error}."
    if isinstance(error, OSError) and error.strerror:
        where = f" {error.filename}" if error.filename else ""
        return f"{error.strerror}:{where}."
    return str(error) or type(error).__name__
