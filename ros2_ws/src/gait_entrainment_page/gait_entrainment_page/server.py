# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The web server of the page, in its own thread, and the gate in front of the page.

The gate sees every request, websockets included. It refuses names that this host does not have
(a foreign site that resolves to it), requests made by another site, and, if the page is served
beyond this host or a token was chosen, requests without a token.
"""

import logging
import secrets
import socket
import threading
from typing import Any

import uvicorn
from fastapi import FastAPI, Request
from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.websockets import WebSocketClose

from gait_entrainment_page.access import Access

# Cookies with the browser's identity and token: one name per port, as cookies ignore ports.
_BROWSER, _TOKEN = "entrain_page_browser", "entrain_page_token"
_CLOSING = 1  # how long open connections may take to end [s]
_POLICY_VIOLATION = 1008  # close code of a refused websocket


class Gate:
    """The gate, an ASGI application in front of another one."""

    def __init__(self, app: Any, access: Access, port: int) -> None:
        self._app, self._access, self._port = app, access, port

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Let a request pass, with ``role`` and ``browser`` in its state, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request = HTTPConnection(scope)
        given = request.query_params.get("token", "")
        token = given or request.cookies.get(f"{_TOKEN}_{self._port}", "")
        role = self._access.role(token)
        answer = self._refusal(request, role, token)
        if answer is None and given and self._access.tokens and scope["type"] == "http":
            cookie = {"set-cookie": self._cookie(_TOKEN, given), "cache-control": "no-store"}
            answer = RedirectResponse("/", 303, cookie)
        if answer is not None:
            await answer(scope, receive, send)
            return
        browser, cookie_to_set = request.cookies.get(f"{_BROWSER}_{self._port}", ""), ""
        if not browser:
            browser = secrets.token_hex(8)
            cookie_to_set = self._cookie(_BROWSER, browser)
        scope.setdefault("state", {}).update(role=role, browser=browser)

        async def send_more(message: Any) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers["x-frame-options"] = "DENY"  # a click in another site's frame would act
                if cookie_to_set:
                    headers.append("set-cookie", cookie_to_set)
            await send(message)

        await self._app(scope, receive, send_more)

    def _refusal(self, request: HTTPConnection, role: str, token: str) -> Any:
        """Return the answer to a request that is refused; None if it is allowed."""
        headers, status = request.headers, 403
        host = headers.get("host", "")
        navigates = headers.get("sec-fetch-mode") == "navigate" and request.get("method") == "GET"
        from_elsewhere = headers.get("sec-fetch-site") in ("cross-site", "same-site")
        if not self._access.knows(host):
            message = "this host has another name: open the address that entrain page has printed"
        elif headers.get("origin", f"http://{host}").partition("://")[2] != host or (
            from_elsewhere and not navigates
        ):
            message = "another site must not use this page"
        elif not role:
            status, wrong = 401, "the token is wrong" if token else "this page asks for a token"
            message = f"{wrong}: open the address that entrain page has printed"
        else:
            return None
        if request["type"] == "websocket":
            return WebSocketClose(_POLICY_VIOLATION)
        return PlainTextResponse(message, status, {"cache-control": "no-store"})

    def _cookie(self, name: str, value: str) -> str:
        # Lax: a browser that follows a link from elsewhere keeps its seat and token.
        return f"{name}_{self._port}={value}; Path=/; HttpOnly; SameSite=Lax"


class Server:
    """Serves the page of an application on ``port`` until it is closed."""

    def __init__(self, app: FastAPI, listener: socket.socket, access: Access) -> None:
        self.port = int(listener.getsockname()[1])
        logging.getLogger("nicegui").setLevel(logging.ERROR)
        config = uvicorn.Config(
            Gate(app, access, self.port),
            log_level="error",
            access_log=False,
            timeout_graceful_shutdown=_CLOSING,
            ws="auto",
        )
        self._server, self._sockets = uvicorn.Server(config), [listener]
        self._thread = threading.Thread(target=self._serve, name="web server", daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        self._server.run(sockets=self._sockets)

    def close(self) -> None:
        """Stop serving."""
        self._server.should_exit = True
        self._thread.join(2 * _CLOSING)


def state_of(request: Request) -> tuple[str, str]:
    """Return the role and the browser of a request, as found by the gate."""
    state: dict[str, Any] = request.scope["state"]
    return str(state["role"]), str(state["browser"])
