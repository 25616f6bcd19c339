# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The node ``session``: takes the operator's requests to a session that `entrain session` conducts.

It is a separate process because a process with a ROS context cannot fork the blocks. Requests go
into the ledger, where the conductor finds them before the next block; so do notes, which nothing
else records between two blocks. The node's state reports how the session stands.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from gait_entrainment.settings import setting, settings_of
from gait_entrainment_msgs.msg import Note
from gait_entrainment_msgs.srv import AskSession
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_sessions.folder import SessionFolder
from gait_entrainment_sessions.session_file import SessionError

# How often the state is updated [s].
_PERIOD = 0.5


@dataclass(frozen=True)
class Settings:
    """Parameters of the node."""

    folder: str = setting("", "folder of the session")


class SessionDesk(Participant):
    """ROS side of a session."""

    settings: Settings
    real_time = False  # it waits for no other node, but needs no priority over them

    def __init__(self) -> None:
        super().__init__("session", settings=Settings, fixed=settings_of(Settings))
        self._folder, self._due = SessionFolder(Path(self.settings.folder)), 0.0
        self.subscribe(topics.OPERATOR_NOTES, self._on_note)
        for name in ("pause", "go_on", "repeat"):
            self.create_service(AskSession, f"~/{name}", self._answered(getattr(self, f"_{name}")))

    def _answered(self, action: Callable[[str], str]) -> Callable[[Any, Any], Any]:
        """Return a service callback that performs an action, or answers why it cannot."""

        def answer(request: AskSession.Request, response: AskSession.Response) -> Any:
            try:
                response.message, response.success = action(request.reason.strip()), True
            except SessionError as error:
                response.message = str(error)
            self._due = 0.0
            return response

        return answer

    def _pause(self, reason: str) -> str:
        if self._folder.paused is not None:
            raise SessionError("a pause is already requested")
        self._folder.note("pause", self._folder.next_block() or 0, text=reason)
        return "the session will wait before its next block"

    def _go_on(self, reason: str) -> str:
        if self._folder.paused is None:
            raise SessionError("the session is not paused")
        self._folder.note("go on", self._folder.next_block() or 0, text=reason)
        return "the session goes on"

    def _repeat(self, reason: str) -> str:
        return f"block {self._folder.repeat(reason)} is the next one again"

    def _on_note(self, note: Note) -> None:
        self._folder.note("note", self._folder.next_block() or 0, text=note.text)

    def next_deadline(self) -> float:
        """Return when to check the session next."""
        return self._due

    def on_deadline(self) -> None:
        """Report how the session stands: a warning while it waits for the operator."""
        self._due = time.monotonic() + _PERIOD
        waits = self._folder.paused is not None
        level = DiagnosticStatus.WARN if waits else DiagnosticStatus.OK
        self.note_state(level, self._folder.standing())


main = SessionDesk.main
