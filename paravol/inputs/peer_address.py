"""Where an OpenIGTLink peer is, as the command line says it."""

from disk import UserError


def peer_address(option: str, text: str) -> tuple[str, int, str | None]:
    """Read HOST:PORT[:TOOL]; ValueError, in one sentence, naming the option."""
    host, _, rest = text.partition(":")
    port, _, tool = rest.partition(":")
    if not (host and port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise UserError(
            f"{option} igtl needs HOST:PORT, such as igtl:localhost:18944; "
            f"got {text!r}."
        )
    return host, int(port), tool or None
