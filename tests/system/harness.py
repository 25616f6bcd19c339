# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Runs as processes and a probe that listens to them, shared by the system tests."""

import json
import math
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.protocol import Protocol, read_protocol, write_protocol
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagReader
from gait_entrainment_bringup.node_list import (
    NODES,
    RECORDER,
    STOP_ORDER,
    parameter_arguments,
    parameters,
)
from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.domain import CLAIMS, claimed_domain
from gait_entrainment_nodes.messaging.environment import come_before_others
from gait_entrainment_nodes.messaging.stamps import header
from gait_entrainment_nodes.messaging.topics import GROUND_REACTION, STRIDES, Topic

# Long enough for a machine with two shared cores; only a failing test waits this long [s].
TIMEOUT = 60.0
# Dynamically similar to the paper's walker, in sixteenfold gravity: the same angles and torques in
# a quarter of the time. For tests that have to wait in real time.
QUICK = ("--gravity=156.96", "--mass=5", "--period-offset=-0.0125", "--width=0.025")
LONG = (*QUICK, "--pulses=2000")
# Topics that architecture.md promises to be the same, byte for byte, in two lock-step runs.
PROMISED_TOPICS = (
    "/joint_states",
    "/gait_events",
    "/ankle_torque",
    "/ground_reaction/left",
    "/ground_reaction/right",
    "/perturbation/torque_profile",
    "/perturbation/pulses",
    "/perturbator/state",
    "/gait/strides",
    "/gait/pulse_phases",
    "/gait/entrainment",
    "/clock",
)


def open_files(pid: int) -> set[str]:
    """Return the files that a process has open, without those that it closes meanwhile."""
    opened = set()
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):
            opened.add(os.readlink(descriptor))
    return opened


def protocol_of(*options: str) -> Protocol:
    """Return the protocol that these command-line options describe."""
    import argparse

    from gait_entrainment_commands.protocol_options import add_protocol_options, chosen_protocol

    parser = argparse.ArgumentParser()
    add_protocol_options(parser)
    return chosen_protocol(parser.parse_args(options))


def stamp_of(header: Any) -> int:
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def payloads(bag: Path, topics: Sequence[str]) -> dict[str, list[tuple[int, bytes]]]:
    """Return log time and bytes of every message by topic, in recorded order."""
    with BagReader(bag) as reader:
        found: dict[str, list[tuple[int, bytes]]] = {topic: [] for topic in topics}
        for message in reader.messages([t for t in topics if t in reader.topics]):
            found[message.topic].append((message.log_time, message.data))
        return found


def events_since_start(bag: Path) -> list[tuple[int, int, int, int]]:
    """Return time since the start, kind, side and step of every recorded gait event."""
    with BagReader(bag) as reader:
        events = [message for _, message in reader.decoded(["/gait_events"])]
    start = stamp_of(events[0].header)
    return [(stamp_of(e.header) - start, e.kind, e.side, e.step) for e in events]


def simulated_events(bag: Path) -> list[tuple[int, int, int, int]]:
    """Return what ``events_since_start`` should return, computed in one process."""
    with BagReader(bag) as reader:
        simulation = simulate(read_protocol(reader.custom_data["protocol"]))
    return [(e.stamp, int(e.kind), int(e.side), e.step) for e in simulation.events]


class Probe:
    """The tests' client in one domain; a wait that times out fails the test."""

    def __init__(self, domain: int) -> None:
        self.client = Client("probe", domain=domain)
        self.node = self.client.node

    def until(self, condition: Callable[[], Any], what: str = "", timeout: float = TIMEOUT) -> Any:
        """Serve ROS until a condition holds; return its value."""
        value = self.client.wait(condition, timeout)
        assert value, f"timed out waiting for {what}"
        return value

    def listen(self, topic: Topic) -> list[Any]:
        """Return a list that grows with the messages of a topic."""
        heard: list[Any] = []
        self.client.subscribe(topic, heard.append)
        return heard

    def call(self, kind: Any, service: str, request: Any = None) -> Any:
        """Call a service of a node that offers ~/ready, once; return its response."""
        self.client.service(kind, service)
        self.client.wait_to_be_known(service.rpartition("/")[0])
        return self.client.call(kind, service, request, period=math.inf)

    def send_goal(self, kind: Any, action: str, goal: Any) -> Any:
        """Send a goal to a node that offers ~/ready; return its handle once there is an answer."""
        self.client.action(kind, action)
        self.client.wait_to_be_known(action.rpartition("/")[0])
        return self.client.send_goal(kind, action, goal)

    def result(self, handle: Any) -> Any:
        """Wait for the result of a goal."""
        answer = self.client.result(handle, TIMEOUT)
        assert answer, "timed out waiting for a result"
        return answer


class Feet:
    """A person's two force sensors, each loaded 60 % of the time."""

    def __init__(self, probe: Probe) -> None:
        self.probe = probe
        self.publishers = [
            probe.node.create_publisher(topic.type, topic.name, 10) for topic in GROUND_REACTION
        ]
        self.silent: set[Side] = set()
        self.value: float | None = None
        self.ahead = 0  # [ns]

    def tick(self) -> None:
        """Publish a sample of each foot, at 200 Hz."""
        now = time.time_ns()
        for side in set(Side) - self.silent:
            phase = (now / 1e9 + 0.5 * side) % 1.0
            force = 800.0 if phase < 0.6 else 0.0
            message = GROUND_REACTION[side].type(header=header(now + self.ahead))
            message.wrench.force.z = force if self.value is None else self.value
            self.publishers[side].publish(message)
        time.sleep(0.005)  # the rate of the samples, not a wait

    def until(self, condition: Callable[[], Any], what: str) -> Any:
        """Publish until a condition holds; return its value."""

        def met() -> Any:
            self.tick()
            return condition()

        return self.probe.until(met, what)


@contextmanager
def probe(domain: int) -> Iterator[Probe]:
    """Yield a probe in a domain."""
    made = Probe(domain)
    with made.client:
        yield made


@contextmanager
def scheduled_like_a_node() -> Iterator[None]:
    """Schedule this process like the nodes of a real-time run, for a test that acts as one."""
    come_before_others()
    try:
        yield
    finally:
        for thread in Path("/proc/self/task").iterdir():
            with suppress(OSError):  # ended meanwhile
                os.sched_setscheduler(int(thread.name), os.SCHED_OTHER, os.sched_param(0))


def stat(pid: int) -> list[str]:
    """Return the fields of a process's /proc/PID/stat, from its state on."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


def alive(pid: int) -> bool:
    """Return whether a process is running, not merely waiting to be reaped."""
    try:
        return stat(pid)[0] != "Z"
    except FileNotFoundError:
        return False


def cpu_seconds(pid: int) -> float:
    """Return the processor time that a process has used."""
    return (int(stat(pid)[11]) + int(stat(pid)[12])) / os.sysconf("SC_CLK_TCK")


class Started:
    """A command that starts nodes, run as a process; it also finds the nodes' processes."""

    names: Sequence[str] = NODES  # of the nodes that it starts

    def __init__(self, command: Sequence[str], out: Path, **environment: str) -> None:
        self.out = out
        with self.out.open("wb") as out_file:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=out_file,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment},
                # A shell's background jobs ignore it, and so would tests run in one.
                preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
            )
        self.nodes: dict[str, int] = {}
        self.ended_at = math.inf  # on the steady clock [s]
        self._watcher = threading.Thread(target=self._watch)
        self._watcher.start()

    def _watch(self) -> None:
        self.process.wait()
        self.ended_at = time.monotonic()

    def wait(self) -> int:
        """Wait for it to end; return its exit code."""
        self._watcher.join(TIMEOUT)
        code = self.process.poll()
        assert code is not None, self.text
        return code

    @property
    def text(self) -> str:
        """What it has printed so far."""
        return self.out.read_text(errors="replace")

    def find_nodes(self, names: Sequence[str] = ()) -> dict[str, int]:
        """Return the process ids of all its nodes, once they are running."""
        names = names or self.names
        deadline = time.monotonic() + TIMEOUT
        while self.nodes.keys() != set(names):
            assert self.process.poll() is None, self.text
            assert time.monotonic() < deadline
            for folder in Path("/proc").glob("[0-9]*"):
                try:
                    words = (folder / "cmdline").read_bytes().split(b"\0")
                    parent = int(stat(int(folder.name))[1])
                except (FileNotFoundError, ProcessLookupError):
                    continue
                if parent != self.process.pid:
                    continue
                for word in words[:2]:
                    name = word.decode().rpartition("/")[2]
                    if name in names:
                        self.nodes[name] = int(folder.name)
        return self.nodes

    def survivors(self) -> list[int]:
        """Return those of its processes that are still running."""
        return [pid for pid in (self.process.pid, *self.nodes.values()) if alive(pid)]

    def end(self) -> None:
        """Kill what still runs, whether or not the test passed."""
        for pid in self.survivors():
            os.kill(pid, signal.SIGKILL)
        self._watcher.join()


class EntrainRun(Started):
    """One ``entrain run``."""

    def __init__(self, bag: Path, *options: str, **environment: str) -> None:
        self.bag = bag
        command = ["entrain", "run", "--out", str(bag), "--no-figures", *options]
        super().__init__(command, bag.with_name(bag.name + ".out"), **environment)

    def outcome(self) -> dict[str, Any]:
        """Wait for it to end successfully; return what ``--json`` printed."""
        assert self.wait() == 0, self.text
        return dict(json.loads(self.text.splitlines()[-1]))

    def domain(self) -> int:
        """Return its domain."""
        self.find_nodes()  # by then it has claimed one, by a socket's name
        held = open_files(self.process.pid)
        for line in Path("/proc/net/unix").read_text().splitlines():
            words = line.split()
            if f"socket:[{words[6]}]" in held and words[-1].startswith(f"@{CLAIMS}/"):
                return int(words[-1].rpartition("/")[2])
        raise AssertionError("it has claimed no domain")

    def wait_for_stride(self, number: int) -> None:
        """Wait until the analyzer has published this stride or a later one."""
        with probe(self.domain()) as listener:
            strides = listener.listen(STRIDES)
            listener.until(
                lambda: (
                    self.process.poll() is not None or (strides and strides[-1].number >= number)
                ),
                "strides",
            )
        assert self.process.poll() is None, self.text


@contextmanager
def entrain_run(bag: Path, *options: str, **environment: str) -> Iterator[EntrainRun]:
    """Start ``entrain run``; leave no process behind."""
    run = EntrainRun(bag, *options, **environment)
    try:
        yield run
    finally:
        run.end()


class Session:
    """The nodes of an experiment without ``entrain run``: the test conducts it."""

    def __init__(
        self,
        folder: Path,
        domain: int,
        options: Sequence[str],
        real_time: bool,
        participants: Sequence[str] = (),
        strangers: bool = False,
        recorded: bool = True,
        **walker: str,
    ) -> None:
        self.bag, self.domain = folder / "bag", domain
        self.protocol = protocol_of(*options)
        bag = self.bag if recorded else None
        given = parameters(self.protocol, bag, real_time=real_time, **walker)
        del given["bag_recorder"]["publishers"]  # it records until it is stopped
        if participants:
            given["experiment"]["participants"] = list(participants)
        if strangers:
            for name in ("planned.torque", "planned.duration", "planned.count"):
                del given["perturbator"][name]
        self.supervisor = Supervisor(folder, {**os.environ, "ROS_DOMAIN_ID": str(domain)})
        self.arguments = parameter_arguments(given, folder)
        self.probe = Probe(domain)

    def start(self, *nodes: str) -> None:
        """Start nodes and wait until each of them answers."""
        for node in nodes:
            self.supervisor.start(node, self.arguments)
        for node in nodes:
            service = self.probe.client.service(Ready, f"{node}/ready")
            self.probe.until(
                lambda service=service: service.service_is_ready() or self.supervisor.ended(), node
            )
            assert not self.supervisor.ended(), self.supervisor.last_lines(node)

    def conduct(self) -> Any:
        """Ask the experiment to conduct the protocol; return the goal's handle."""
        goal = RunProtocol.Goal(protocol=write_protocol(self.protocol))
        return self.probe.send_goal(RunProtocol, "experiment/run_protocol", goal)

    def pid(self, node: str) -> int:
        return self.supervisor._processes[node].pid

    def signal(self, node: str, number: int) -> None:
        os.kill(self.pid(node), number)


@contextmanager
def session(
    folder: Path,
    *options: str,
    nodes: Sequence[str] = NODES,
    real_time: bool = True,
    participants: Sequence[str] = (),
    strangers: bool = False,
    **walker: str,
) -> Iterator[Session]:
    """
    Start nodes in their own domain; stop them at the end.

    ``walker`` and ``detector`` are those of `parameters`. If ``strangers`` may request pulses,
    the perturbator knows no protocol that these must belong to.
    """
    with claimed_domain() as domain:
        settings = (options, real_time, participants, strangers, RECORDER in nodes)
        running = Session(folder, domain, *settings, **walker)
        try:
            running.start(*nodes)
            yield running
        finally:
            running.probe.client.close()
            running.supervisor.stop(STOP_ORDER)
