"""Bytes from a line, for a person to read."""

_SHOWN = 40


def readable(data: bytes) -> str:
    """Return plain text in quotes, anything else as hexadecimal bytes."""
    if not data:
        return "nothing"
    shown = data[:_SHOWN]
    more = f" and {len(data) - _SHOWN} bytes more" if len(data) > _SHOWN else ""
    if all(32 <= byte < 127 for byte in shown):
        return f"'{shown.decode('ascii')}'{more}"
    return f"the bytes {shown.hex(' ').upper()}{more}"
