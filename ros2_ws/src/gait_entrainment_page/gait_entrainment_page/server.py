# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The web server of the page: in a thread of its own, beside whatever the process does."""

import logging
import socket
import threading
from typing import Any

import uvicorn
from fastapi import FastAPI, Request

from gait_entrainment_page.access import Access, Gate

_CLOSING = 1  # how long open connections may take to end [s]


class Server:
    """Serves the page of an application until it is closed; ``port`` is where."""

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
        """Serve no more."""
        self._server.should_exit = True
        self._thread.join(2 * _CLOSING)


def state_of(request: Request) -> tuple[str, str]:
    """Return the role and the browser of a request, as the gate has found them."""
    state: dict[str, Any] = request.scope["state"]
    return str(state["role"]), str(state["browser"])
