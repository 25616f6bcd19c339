# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Conduct a session: block after block, each in its own process, with rests between."""

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
from gait_entrainment.robot import DeviceLimits, LimitError, find_driver
from gait_entrainment_bags import BagError, BagReader
from gait_entrainment_bags.messages import profile_of, stop_of
from gait_entrainment_bags.topic_names import TORQUE_PROFILE
from gait_entrainment_bringup.commands.run import run_experiment
from gait_entrainment_bringup.node_process import end_with
from gait_entrainment_commands.signals import end_once, undisturbed
from gait_entrainment_drivers.proof import preflight_of
from gait_entrainment_sessions.folder import KEY_HASH, SessionFolder
from gait_entrainment_sessions.session_file import Session, SessionError

# How often a paused session checks whether it may go on [s].
_CHECK_PERIOD = 0.1


class BlockFailedError(EntrainmentError):
    """A block did not end well; the session can be resumed at it."""


class SessionRun:
    """
    Conducts what is left of a session.

    Its blocks run in a ROS ``domain``. ``ask`` takes a question and returns the operator's answer;
    no questions are asked without a terminal, or if a page is shown instead.
    """

    def __init__(
        self,
        session: Session,
        folder: SessionFolder,
        options: argparse.Namespace,
        domain: int,
        ask: Callable[[str], str] | None = None,
    ) -> None:
        self._domain = domain
        self._session, self._folder, self._options = session, folder, options
        self._ask = ask or (input if sys.stdin.isatty() and not options.page else None)
        # In lock-step there is no person who could need a rest.
        self._rests = options.real_time and not options.no_rest

    def conduct(self) -> None:
        """Conduct block after block; raises BlockFailedError, SessionError."""
        folder, options = self._folder, self._options
        if options.note:
            folder.note("note", text=options.note)
        if options.repeat is not None:
            folder.repeat(options.reason, options.repeat)
        if folder.paused is not None:  # by repeating the command
            folder.note("go on", text="resumed")
        rested = not folder.runs()
        while True:
            if folder.paused is not None:
                self._wait()
            if (number := folder.next_block()) is None:
                return
            if self._rests and not rested:
                self._rest(number)
                rested = True
            elif self._ask and not self._agreed(number):
                return
            elif folder.next_block() == number:  # else the block before is to be repeated
                self._run(number)
                rested = False

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
                print("p REASON pauses, r REASON repeats the block before, n TEXT adds a note")
            elif word == "n":
                self._folder.note("note", number, text=text)
            elif word == "p":
                self._folder.note("pause", number, text=text)
                return False
            else:
                self._folder.repeat(text)
                return True

    def _wait(self) -> None:
        """Wait until the operator lets the session go on."""
        print(f"{self._folder.standing()}; session/go_on resumes it", file=sys.stderr, flush=True)
        while self._folder.paused is not None:
            time.sleep(_CHECK_PERIOD)

    def _rest(self, number: int) -> None:
        """Count down the rest before a block."""
        seconds = self._session.ordered[number - 1].rest
        self._folder.note("rest", number, text=f"{seconds:g} s")
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
            result = f"{checked.at}: {checked.failed or 'passed'}" if checked else "none"
            folder.note("preflight", number, text=result)
        folder.note("begun", number, bag.name)
        print(f"block {number} of {len(session.blocks)}     {session.shown(number)}", flush=True)
        bag.mkdir(parents=True)
        reason = self._in_a_process(protocol, bag, about)
        if reason:
            folder.note("failed", number, bag.name, reason)
            why, *log = reason.splitlines()
            message = f"block {number}: {why}; the same command resumes at this block"
            raise BlockFailedError("\n".join([message, *log]))
        folder.note("done", number, bag.name)

    def _in_a_process(self, protocol: Protocol, bag: Path, about: dict[str, str]) -> str:
        """
        Conduct a block in a new process; return why it failed, or an empty text.

        A run forks its nodes, which a process can do only before it has had a ROS context.
        """
        context: Any = multiprocessing.get_context("fork")
        ours, theirs = context.Pipe(duplex=False)
        keyboard = os.dup(0)  # multiprocessing closes a child's standard input
        conduct = partial(
            run_experiment,
            protocol,
            bag,
            self._domain,
            # There is one page for all blocks.
            options=argparse.Namespace(**vars(self._options) | {"page": False}),
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
        Return a protocol whose limits of a whole session are what the earlier blocks have left.

        Each block has its own perturbator, which knows only what it has delivered itself.
        """
        limits, defaults = protocol.limits, DeviceLimits()
        bags, ordered = self._folder.path / "bags", self._session.ordered
        begun = {bags / e.bag: int(e.block) for e in self._folder.ledger if e.what == "begun"}
        runs = ((bag, ordered[number - 1].protocol) for bag, number in begun.items())
        given = [piece for bag, of in runs for piece in _delivered(bag, of)]
        pulses, impulse = sum(count for count, _ in given), sum(part for _, part in given)
        lower: dict[str, Any] = {}
        if limits.session_pulses != defaults.session_pulses:
            lower["session_pulses"] = max(limits.session_pulses - pulses, 0)
        if limits.session_impulse != defaults.session_impulse:
            lower["session_impulse"] = max(limits.session_impulse - impulse, 0.0)
        left = replace(protocol, limits=replace(limits, **lower))
        try:
            left.check_limits()
        except LimitError as error:
            given_before = f"{pulses} pulses with {impulse:.4g} N m s were delivered before"
            raise SessionError(f"limits.{error}, since {given_before}") from None
        return left


def _delivered(bag: Path, protocol: Protocol) -> list[tuple[int, float]]:
    """
    Return how many pulses began in each profile of a bag, and their impulse [N m s].

    If the bag cannot be read, as after a crash, every pulse of its protocol counts as delivered.
    """
    try:
        with BagReader(bag) as reader:
            messages = [m for m in reader.messages_of(TORQUE_PROFILE) if stop_of(m) is None]
            return [
                (
                    len(profile.onsets),
                    sum(abs(t) * (end - begin) / 1e9 for begin, end, t in profile.pieces),
                )
                for profile in map(profile_of, messages)
            ]
    except BagError:
        if not any(bag.glob("*")) and not bag.with_name(f"{bag.name}_unfinished").exists():
            return []  # nothing had started
        planned = protocol.planned
        return [(planned.count, planned.count * planned.torque * planned.duration)]


def _conduct(parent: int, answer: Any, keyboard: int, conduct: Callable[..., None]) -> None:
    """Conduct one block in this child process; send the parent the reason if it failed."""
    os.dup2(keyboard, 0)  # so that the space bar stops the run
    end_once()
    reason = ""
    try:
        if not end_with(parent):
            return
        conduct()
    except (EntrainmentError, OSError) as error:
        reason = str(error)
    except KeyboardInterrupt:
        reason = "interrupted"
    with suppress(OSError):  # the parent was killed
        answer.send(reason)
