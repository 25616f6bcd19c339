# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Who may look and who may act: a gate in front of the page, and the seat of the operator.

The gate sees every request, websockets included. It refuses names that this host does not have
(a stranger's site that resolves to it), requests that another site makes, and, beyond this host
or where a token was chosen, whoever brings no token. Stopping is safe, so whoever may look may
stop.
"""

import errno
import ipaddress
import math
import os
import secrets
import socket
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import parse_qs, urlsplit

from gait_entrainment.errors import UsageError

LOOK, ACT = "look", "act"
LOOPBACK = ("127.0.0.1", "localhost", "::1")
TOKEN_LENGTH = 8  # at the least, of one that is chosen
# Who the browser is, and what it may: one name for each port, as cookies know no ports.
_BROWSER, _TOKEN = "entrain_page_browser", "entrain_page_token"
TOKENS_VARIABLE = "ENTRAIN_PAGE_TOKENS"  # to act, to look on
LONGEST_NOTE = 500


@dataclass
class Access:
    """Who may look and act: without ``tokens``, whoever reaches a page bound to this host."""

    host: str
    tokens: dict[str, str] = field(default_factory=dict)  # role by token

    @classmethod
    def of(cls, host: str, token: str = "", look_token: str = "") -> "Access":
        """Return that to a page of a host; raises UsageError for a chosen token that is short."""
        for given in filter(None, (token, look_token)):
            if len(given) < TOKEN_LENGTH or not (given.isascii() and given.isalnum()):
                raise UsageError(f"--token: allowed: at least {TOKEN_LENGTH} letters and digits")
        if host in LOOPBACK and not token:
            return cls(host)
        made = secrets.token_hex
        return cls(host, {look_token or made(8): LOOK, token or made(8): ACT})

    @classmethod
    def of_environment(cls, host: str, token: str = "") -> "Access":
        """Return the access with the tokens of the environment, unless another one is chosen."""
        tokens = [token] if token else os.environ.get(TOKENS_VARIABLE, "").split()[:2]
        return cls.of(host, *tokens)

    @property
    def environment(self) -> dict[str, str]:
        """The environment variable that hands the tokens on to a process."""
        by_role = {role: token for token, role in self.tokens.items()}
        return {TOKENS_VARIABLE: f"{by_role[ACT]} {by_role[LOOK]}"} if by_role else {}

    def addresses(self, port: int) -> list[tuple[str, str]]:
        """Return what a person is told: what for, and the address."""
        name = self.host
        if name in ("0.0.0.0", "::"):
            name = socket.gethostname()
        base = f"http://{f'[{name}]' if ':' in name else name}:{port}/"
        if not self.tokens:
            return [("page", base)]
        what = {ACT: "page, to act", LOOK: "page, to look on"}
        return [(what[role], f"{base}?token={token}") for token, role in self.tokens.items()]

    def tell(self, port: int) -> None:
        """Tell people the addresses, on standard error."""
        for what, address in self.addresses(port):
            print(f"{what}: {address}", file=sys.stderr, flush=True)

    def role(self, token: str) -> str:
        """Return what a token permits; an empty text if nothing."""
        if not self.tokens:
            return ACT
        found = ""
        for known, role in self.tokens.items():  # each is compared, in constant time
            if secrets.compare_digest(known.encode(), token.encode()):
                found = role
        return found

    def knows(self, place: str) -> bool:
        """Whether a place in a request has a name of this host, not one that leads to it."""
        try:
            name = urlsplit(f"//{place}").hostname or ""
        except ValueError:  # nor any name at all
            return False
        if self.host in LOOPBACK:
            return name in LOOPBACK
        try:
            ipaddress.ip_address(name)
        except ValueError:
            own = socket.gethostname().lower()
            return name in {self.host.lower(), "localhost", own, f"{own}.local"}
        return True


class Gate:
    """The gate, an ASGI application before another one."""

    def __init__(self, app: Any, access: Access, port: int) -> None:
        self._app, self._access, self._port = app, access, port

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Let a request pass, with ``role`` and ``browser`` in its state, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {k.decode("latin-1"): v.decode("latin-1") for k, v in scope["headers"]}
        # Beside ours come those of whatever else this host serves, which need not be well-formed.
        pairs = (pair.strip().partition("=") for pair in headers.get("cookie", "").split(";"))
        cookies = {name: value for name, _, value in pairs}
        if refusal := self._refusal(scope, headers):
            await _answer(scope, send, 403, refusal)
            return
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
        given = query.get("token", [""])[0]
        token = given or cookies.get(self._name(_TOKEN), "")
        role = self._access.role(token)
        if not role:
            wrong = "the token is wrong" if token else "this page asks for a token"
            told = f"{wrong}: open the address that entrain page has printed"
            await _answer(scope, send, 401, told)
            return
        if given and self._access.tokens and scope["type"] == "http":
            cookie = self._cookie(_TOKEN, given)
            await _answer(scope, send, 303, "", [("location", "/"), ("set-cookie", cookie)])
            return
        browser = cookies.get(self._name(_BROWSER), "")
        cookie = ""
        if not browser:
            browser = secrets.token_hex(8)
            cookie = self._cookie(_BROWSER, browser)
        scope.setdefault("state", {}).update(role=role, browser=browser)

        async def send_more(message: Any) -> None:
            if message["type"] == "http.response.start":
                more = [(b"x-frame-options", b"DENY")]  # a click within another site's page acts
                more += [(b"set-cookie", cookie.encode())] if cookie else []
                message["headers"] = [*message["headers"], *more]
            await send(message)

        await self._app(scope, receive, send_more)

    def _refusal(self, scope: Any, headers: dict[str, str]) -> str:
        """Return why a request is refused, whoever makes it; an empty text if it is not."""
        host = headers.get("host", "")
        if not self._access.knows(host):
            return "this host has another name: open the address that entrain page has printed"
        if headers.get("origin", f"http://{host}").partition("://")[2] != host:
            return "another site must not use this page"
        navigates = headers.get("sec-fetch-mode") == "navigate" and scope.get("method") == "GET"
        if headers.get("sec-fetch-site") in ("cross-site", "same-site") and not navigates:
            return "another site must not use this page"
        return ""

    def _name(self, cookie: str) -> str:
        return f"{cookie}_{self._port}"

    def _cookie(self, name: str, value: str) -> str:
        # Lax: a link elsewhere that leads here finds the same browser, with its seat and token.
        return f"{self._name(name)}={value}; Path=/; HttpOnly; SameSite=Lax"


async def _answer(
    scope: Any, send: Any, status: int, text: str, headers: Iterable[tuple[str, str]] = ()
) -> None:
    """Answer a request in one line of text; a websocket is closed."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    told = [("content-type", "text/plain; charset=utf-8"), ("cache-control", "no-store"), *headers]
    encoded = [(name.encode(), value.encode()) for name, value in told]
    await send({"type": "http.response.start", "status": status, "headers": encoded})
    await send({"type": "http.response.body", "body": text.encode()})


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
        """Note a sign of life, by which a free seat is taken, or that there will be none."""
        if watching:
            self.holder = self.holder or browser
        if browser == self.holder:
            self._heard_at = time.monotonic() if watching else -math.inf

    def take(self, browser: str) -> None:
        """Take the seat, whoever has it, by a click: a sign of life itself."""
        self.holder, self._heard_at = browser, time.monotonic()

    @property
    def watched(self) -> bool:
        """Whether the operator's page is open, in front and answers."""
        return time.monotonic() - self._heard_at < self.timeout


def listen(host: str, port: int, option: str = "--port") -> socket.socket:
    """Return a socket that listens; UsageError if the port is taken, or the host is another."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        causes = {errno.EADDRINUSE: "taken by another program", errno.EACCES: "for root alone"}
        told = f"--host: {host}: {error.strerror}; allowed: an address of here"
        if (cause := causes.get(error.errno or 0)) is not None:
            told = f"{option}: {port} is {cause}; choose another, or 0 for a free one"
        raise UsageError(told) from None
    return listener


def one_line(text: str, longest: int = LONGEST_NOTE) -> str:
    """Return what somebody typed as one line of characters that can be seen, cut to a length."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:longest]
