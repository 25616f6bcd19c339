# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Conducting a session: block after block, each in its own process, with rests between."""

import argparse
import math
import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from gait_entrainment.errors import EntrainmentError
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import DeviceLimits, find_driver
from gait_entrainment_bags import BagError, BagReader
from gait_entrainment_bags.topic_names import PULSES
from gait_entrainment_bringup.commands.run import run_experiment
from gait_entrainment_bringup.node_process import end_with
from gait_entrainment_drivers.proof import preflight_of
from gait_entrainment_drivers.signals import end_once, undisturbed
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_sessions.folder import KEY_HASH, SessionFolder
from gait_entrainment_sessions.session_file import Session, SessionError


class BlockFailedError(EntrainmentError):
    """A block did not end well; the session can be resumed at it."""


class SessionRun:
    """
    Conducts what is left of a session.

    ``ask`` gets a question and returns the operator's answer; without a terminal nobody is asked.
    """

    def __init__(
        self,
        session: Session,
        folder: SessionFolder,
        options: argparse.Namespace,
        ask: Callable[[str], str] | None = None,
    ) -> None:
        self._session, self._folder, self._options = session, folder, options
        self._ask = ask or (input if sys.stdin.isatty() else None)
        # With nobody in the walker's place there is nobody to rest.
        self._rests = options.real_time and not options.no_rest

    def conduct(self) -> None:
        """Conduct block after block; raises BlockFailedError, SessionError."""
        folder, options = self._folder, self._options
        if options.note:
            folder.note("note", text=options.note)
        if options.repeat is not None:
            self._repeat(options.repeat, options.reason)
        rested = not folder.runs()
        while (number := folder.next_block()) is not None:
            block = self._session.ordered[number - 1]
            if self._rests and not rested:
                self._rest(block.rest)
            rested = False
            if self._ask and not self._agreed(number):
                return
            if folder.next_block() == number:  # else the one before is to be repeated
                self._run(number)

    def _agreed(self, number: int) -> bool:
        """Ask the operator what is next; return whether the session goes on now."""
        assert self._ask is not None
        count = len(self._session.blocks)
        question = f"block {number} of {count} ({self._session.shown(number)}): Enter, p, r, n? "
        while True:
            try:
                word, _, text = self._ask(question).strip().partition(" ")
            except EOFError:
                word, text = "p", "the input ended"
            if not word:
                return True
            if word not in ("p", "r", "n") or not text.strip():
                print("p REASON pauses, r REASON repeats the block before, n TEXT notes")
            elif word == "n":
                self._folder.note("note", number, text=text)
            elif word == "p":
                self._folder.note("pause", number, text=text)
                return False
            else:
                self._repeat(number - 1, text)
                return True

    def _repeat(self, number: int, reason: str) -> None:
        done = self._folder.runs()
        if number not in done:
            allowed = ", ".join(map(str, done)) or "none yet"
            raise SessionError(f"repeat: block {number} is not done; allowed: {allowed}")
        self._folder.note("repeat", number, done[number].name, reason)

    def _rest(self, seconds: float) -> None:
        """Count a rest down."""
        end = time.monotonic() + seconds
        while (left := math.ceil(end - time.monotonic())) > 0:
            print(f"\r\x1b[Krest: {left} s", end="", file=sys.stderr, flush=True)
            time.sleep(min(1.0, max(end - time.monotonic(), 0.0)))
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _run(self, number: int) -> None:
        session, folder = self._session, self._folder
        protocol = self._within_dose(session.ordered[number - 1].protocol)
        protocol = replace(protocol, name=session.shown(number))
        bag = folder.new_bag(number)
        about = {
            "study": session.study,
            "person": session.person.code,
            "session": session.session,
            "block": str(number),
            "block_name": session.shown(number),
        }
        if session.blind:
            about[KEY_HASH] = folder.plan["key"]
        if not find_driver(protocol.driver).simulated:
            checked = preflight_of(protocol.driver)
            told = f"{checked.at}: {checked.failed or 'passed'}" if checked else "none"
            folder.note("preflight", number, text=told)
        folder.note("begun", number, bag.name)
        print(f"block {number} of {len(session.blocks)}     {session.shown(number)}", flush=True)
        bag.mkdir(parents=True)
        reason = self._in_a_process(protocol, bag, about)
        if reason:
            folder.note("failed", number, bag.name, reason)
            raise BlockFailedError(
                f"block {number}: {reason.splitlines()[0]}; the same command resumes at it"
            )
        folder.note("done", number, bag.name)

    def _in_a_process(self, protocol: Protocol, bag: Path, about: dict[str, str]) -> str:
        """
        Conduct a block in a fresh process; return why it failed, an empty text if it did not.

        A run forks its nodes, which a process can do only before it has had a ROS context.
        """
        context: Any = multiprocessing.get_context("fork")
        ours, theirs = context.Pipe(duplex=False)
        keyboard = os.dup(0)  # multiprocessing closes a child's standard input
        conduct = partial(
            run_experiment,
            protocol,
            bag,
            options=self._options,
            quiet=self._session.blind,  # a blinded operator does not see where the pulses fall
            about=about,
        )
        child = context.Process(target=_conduct, args=(os.getpid(), theirs, keyboard, conduct))
        child.start()
        os.close(keyboard)
        theirs.close()
        try:
            reason = ours.recv()
        except EOFError:
            reason = "its process ended unexpectedly"
        except KeyboardInterrupt:
            with undisturbed():  # torque first, then the record, as at the end of any run
                child.terminate()
                child.join()
            reason = "interrupted"
        child.join()
        return str(reason)

    def _within_dose(self, protocol: Protocol) -> Protocol:
        """
        Return a protocol whose limits of a whole session are what the blocks before have left.

        Each block has a perturbator of its own, which knows only what it has delivered itself.
        """
        said, unsaid = protocol.limits, DeviceLimits()
        lower: dict[str, Any] = {}
        given = [
            pulse
            for bag in sorted((self._folder.path / "bags").glob("*"))
            for pulse in _delivered(bag, protocol)
        ]
        if said.session_pulses != unsaid.session_pulses:
            planned, left = protocol.planned.count, said.session_pulses - len(given)
            if planned > left:
                raise SessionError(
                    f"limits.session_pulses: {planned} more pulses; allowed: {max(left, 0)}, "
                    f"since {len(given)} of {said.session_pulses} were delivered"
                )
            lower["session_pulses"] = left
        if said.session_impulse != unsaid.session_impulse:
            impulse = sum(abs(torque) * width for torque, width in given)
            lower["session_impulse"] = max(said.session_impulse - impulse, 0.0)
        return replace(protocol, limits=replace(said, **lower))


def _delivered(bag: Path, protocol: Protocol) -> list[tuple[float, float]]:
    """
    Return height [N m] and width [s] of the pulses of a bag.

    If it cannot be read, as after a crash, every pulse of this protocol counts as delivered.
    """
    if not any(bag.iterdir()):  # nothing had begun
        return []
    try:
        with BagReader(bag) as reader:
            return [(pulse.torque, pulse.duration) for pulse in reader.messages_of(PULSES)]
    except BagError:
        return [(protocol.pulse_torque, protocol.planned.duration)] * protocol.planned.count


def _conduct(parent: int, answer: Any, keyboard: int, conduct: Callable[..., None]) -> None:
    """Conduct one block in a process of its own; tell the parent how it ended."""
    os.dup2(keyboard, 0)
    sys.stdin = os.fdopen(0, closefd=False)  # the space bar stops
    end_once()
    reason = ""
    try:
        if not end_with(parent):
            return
        with claimed_domain() as domain:
            conduct(domain=domain)
    except (EntrainmentError, OSError) as error:
        reason = str(error)
    except KeyboardInterrupt:
        reason = "interrupted"
    with suppress(OSError):  # the parent was killed
        answer.send(reason)
