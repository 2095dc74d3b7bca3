"""Addresses of the emulator on the network: loopback, unless the user asks for more."""

from harness.errors import BadInput

_LOOPBACK = ("127.0.0.1", "::1", "localhost")


def parse_address(text: str, default_host: str = "") -> tuple[str, int]:
    """Split `HOST:PORT`, or `PORT` where there is a default host. Raises BadInput."""
    host, _, number = text.rpartition(":")
    host = host or default_host
    if not host or not (number.isascii() and number.isdecimal() and len(number) <= 5) or int(number) > 65535:
        raise BadInput(f"{text!r} is no HOST:PORT.", "An example is 127.0.0.1:5005.")
    return host.strip("[]"), int(number)


def check_loopback(host: str, anywhere: bool, risk: str) -> None:
    """Raise BadInput for an address outside this computer, unless `anywhere`. `risk` says what others could do."""
    if host not in _LOOPBACK and not anywhere:
        raise BadInput(f"{host} is reachable from other computers.", f"Use 127.0.0.1, or --anywhere: {risk}.")
