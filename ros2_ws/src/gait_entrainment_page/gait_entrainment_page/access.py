# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Who may look and who may act: the names of this host, the tokens, and the operator's seat.

Stopping is safe, so anyone who may look may stop.
"""

import errno
import ipaddress
import math
import os
import secrets
import socket
import sys
import time
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from gait_entrainment.errors import UsageError

LOOK, ACT = "look", "act"
LOOPBACK = ("127.0.0.1", "localhost", "::1")
TOKEN_LENGTH = 8  # of a chosen token, at least
TOKENS_VARIABLE = "ENTRAIN_PAGE_TOKENS"  # to act, to look on
LONGEST_NOTE = 500


@dataclass
class Access:
    """Who may look and act: without ``tokens``, anyone who reaches a page bound to this host."""

    host: str
    tokens: dict[str, str] = field(default_factory=dict)  # role by token

    @classmethod
    def of(cls, host: str, token: str = "", look_token: str = "") -> "Access":
        """Return the access to a page on a host; raises UsageError if a chosen token is short."""
        for given in filter(None, (token, look_token)):
            if len(given) < TOKEN_LENGTH or not (given.isascii() and given.isalnum()):
                raise UsageError(f"--token: allowed: at least {TOKEN_LENGTH} letters and digits")
        if host in LOOPBACK and not token:
            return cls(host)
        made = secrets.token_hex
        return cls(host, {look_token or made(8): LOOK, token or made(8): ACT})

    @classmethod
    def of_environment(cls, host: str, token: str = "") -> "Access":
        """Return the access with the environment's tokens, unless one is given."""
        tokens = [token] if token else os.environ.get(TOKENS_VARIABLE, "").split()[:2]
        return cls.of(host, *tokens)

    @property
    def environment(self) -> dict[str, str]:
        """The environment variable that passes the tokens to a process."""
        by_role = {role: token for token, role in self.tokens.items()}
        return {TOKENS_VARIABLE: f"{by_role[ACT]} {by_role[LOOK]}"} if by_role else {}

    def addresses(self, port: int) -> list[tuple[str, str]]:
        """Return the addresses to print, each after its purpose."""
        name = self.host
        if name in ("0.0.0.0", "::"):
            name = socket.gethostname()
        base = f"http://{f'[{name}]' if ':' in name else name}:{port}/"
        if not self.tokens:
            return [("page", base)]
        what = {ACT: "page, to act", LOOK: "page, to look on"}
        return [(what[role], f"{base}?token={token}") for token, role in self.tokens.items()]

    def announce(self, port: int) -> None:
        """Print the addresses on standard error."""
        for what, address in self.addresses(port):
            print(f"{what}: {address}", file=sys.stderr, flush=True)

    def role(self, token: str) -> str:
        """Return the role that a token permits; empty if none."""
        if not self.tokens:
            return ACT
        found = ""
        for known, role in self.tokens.items():  # each is compared, in constant time
            if secrets.compare_digest(known.encode(), token.encode()):
                found = role
        return found

    def knows(self, place: str) -> bool:
        """Whether a request names this host, and not another name that resolves to it."""
        try:
            name = urlsplit(f"//{place}").hostname or ""
        except ValueError:  # not a valid name
            return False
        if self.host in LOOPBACK:
            return name in LOOPBACK
        try:
            ipaddress.ip_address(name)
        except ValueError:
            own = socket.gethostname().lower()
            return name in {self.host.lower(), "localhost", own, f"{own}.local"}
        return True


class Seat:
    """
    The operator's seat: one browser acts at a time, until another takes over.

    ``timeout`` is how long its holder may be silent before it counts as away [s].
    """

    def __init__(self, timeout: float) -> None:
        self.timeout = timeout
        self.holder = ""
        self._heard_at = -math.inf  # steady time [s]

    def heard(self, browser: str, *, watching: bool) -> None:
        """Note a sign of life, which takes a free seat, or that there will be none."""
        if watching:
            self.holder = self.holder or browser
        if browser == self.holder:
            self._heard_at = time.monotonic() if watching else -math.inf

    def take(self, browser: str) -> None:
        """Take the seat from any holder, by a click, which is itself a sign of life."""
        self.holder, self._heard_at = browser, time.monotonic()

    @property
    def watched(self) -> bool:
        """Whether the operator's page is open, in front and responding."""
        return time.monotonic() - self._heard_at < self.timeout


def listen(host: str, port: int, option: str = "--port") -> socket.socket:
    """Return a listening socket; UsageError if the port is taken or the host is not this one."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        causes = {errno.EADDRINUSE: "taken by another program", errno.EACCES: "only for root"}
        message = f"--host: {host}: {error.strerror}; allowed: an address of this computer"
        if (cause := causes.get(error.errno or 0)) is not None:
            message = f"{option}: {port} is {cause}; choose another, or 0 for a free one"
        raise UsageError(message) from None
    return listener


def one_line(text: str, longest: int = LONGEST_NOTE) -> str:
    """Return typed text as one line of printable characters, cut to a length."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:longest]
