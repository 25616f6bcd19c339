# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Live, replayed and analyzed offline: the same strides and pulse phases, byte for byte."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness import TIMEOUT, Probe, entrain_run, payloads, probe

from gait_entrainment.gait import VerdictSettings
from gait_entrainment_bags import BagReader, BagWriter
from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_bringup import replay_client, supervisor
from gait_entrainment_bringup.commands import replay as replay_command
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.errors import NodeError
from gait_entrainment_nodes.messaging.player_services import srv
from gait_entrainment_nodes.messaging.raw_messages import serialize
from gait_entrainment_nodes.messaging.stamps import to_time
from gait_entrainment_nodes.messaging.topics import CLOCK, GAIT_EVENTS
from gait_entrainment_nodes.nodes.gait_analyzer_run import Run

BAG = Path(__file__).parents[2] / "bags" / "paper_example"
RESULTS = ("/gait/strides", "/gait/pulse_phases")
RUNS = {
    "entrained": ("--pulses=25", "--baseline=4", "--washout=4", "--initial-phase=0.7"),
    # Too far from its own period: the gait follows for a while, then slips.
    "drifting": ("--pulses=25", "--baseline=4", "--washout=4", "--period-offset=-0.2"),
}


@pytest.fixture(scope="module", params=list(RUNS))
def live(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp(request.param) / "live"
    with entrain_run(bag, *RUNS[request.param], "--sample-rate=20", "--json") as run:
        assert run.outcome()["verdict"] == request.param
    return bag


def replay(*arguments: object) -> tuple[int, Any]:
    """Run ``entrain replay --json``; return its exit code and what it printed."""
    ended = subprocess.run(
        ["entrain", "replay", *map(str, arguments), "--json"],
        capture_output=True,
        text=True,
        timeout=2 * TIMEOUT,
    )
    assert ended.stdout, ended.stderr
    return ended.returncode, json.loads(ended.stdout)


def offline(bag: Path) -> dict[str, list[bytes]]:
    """Analyze a bag without ROS; return what a node would have published."""
    run = read_run(bag, torques=False)
    analyzed = Run(1, run.protocol.side, VerdictSettings(), measured=False)
    return {
        "/gait/strides": [serialize(analyzed.message_of(s)) for s in run.analysis.strides],
        "/gait/pulse_phases": [serialize(analyzed.message_of(p)) for p in run.analysis.pulses],
    }


def recorded(bag: Path) -> dict[str, list[bytes]]:
    return {topic: [data for _, data in found] for topic, found in payloads(bag, RESULTS).items()}


def test_live_replayed_and_offline_are_the_same(live: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    code, outcome = replay(live, "--out", again)
    assert (code, outcome["as_published_live"], outcome["differences"]) == (0, True, [])
    assert recorded(again) == recorded(live) == offline(live)
    assert all(recorded(live).values())
    # The replayed bag is a record like the first and gives the same outcome.
    first, second = (read_run(bag, torques=False) for bag in (live, again))
    assert first.differences == second.differences == ()
    # As text, which is exact: NaN does not equal itself.
    assert repr(second.analysis) == repr(first.analysis)
    assert second.lost == 0


def test_the_rate_does_not_matter(live: Path) -> None:
    for rate in (30, 1000):
        code, outcome = replay(live, "--rate", rate)
        assert (code, outcome["as_published_live"]) == (0, True)


def without(bag: Path, out: Path, drop: Callable[[int, str, Any], bool]) -> Path:
    """Copy a bag without the messages that ``drop`` selects by number, topic and content."""
    with BagReader(bag) as reader:
        data = {k: v for k, v in reader.custom_data.items() if k != "messages_lost"}
        with BagWriter(out, ros_distro="jazzy", custom_data=data) as writer:
            numbers = dict.fromkeys(reader.topics, 0)
            for topic in reader.topics.values():
                writer.add_topic(topic)
            for message in sorted(reader.messages(), key=lambda message: message.place):
                number = numbers[message.topic]
                numbers[message.topic] += 1
                content = decoder_for(reader.topics[message.topic])(message.data)
                if not drop(number, message.topic, content):
                    writer.write(
                        message.topic, message.data, message.log_time, message.publish_time
                    )
    return out


@pytest.mark.parametrize(
    "drop",
    [
        pytest.param(
            lambda n, topic, _: topic == "/gait_events" and n in (30, 47, 48, 61), id="gaps"
        ),
        pytest.param(lambda _, topic, c: topic == "/walker/progress" and c.state, id="no end"),
    ],
)
def test_a_bag_with_missing_messages_gives_the_same_replayed_and_offline(
    live: Path, tmp_path: Path, drop: Callable[[int, str, Any], bool]
) -> None:
    damaged = without(live, tmp_path / "damaged", drop)
    again = tmp_path / "again"
    code, outcome = replay(damaged, "--out", again)
    lacks_events = offline(damaged) != offline(live)
    assert code == lacks_events
    assert bool(outcome["differences"]) is lacks_events
    assert recorded(again) == offline(damaged)
    assert (read_run(damaged, torques=False).differences != ()) is lacks_events


def test_a_run_in_a_namespace_is_replayed_and_recorded_there(live: Path, tmp_path: Path) -> None:
    moved, again = tmp_path / "moved", tmp_path / "again"
    with BagReader(live) as reader:
        data = {k: v for k, v in reader.custom_data.items() if k != "messages_lost"}
        with BagWriter(moved, ros_distro="jazzy", custom_data=data) as writer:
            for topic in reader.topics.values():
                writer.add_topic(replace(topic, name=f"/lab{topic.name}"))
            for message in sorted(reader.messages(), key=lambda message: message.place):
                writer.write(
                    f"/lab{message.topic}", message.data, message.log_time, message.publish_time
                )
    code, outcome = replay(moved, "--out", again)
    assert (code, outcome["as_published_live"]) == (0, True)
    results = payloads(again, [f"/lab{topic}" for topic in RESULTS])
    assert [[data for _, data in found] for found in results.values()] == [
        *recorded(live).values()
    ]


def test_an_analyzer_that_hangs_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay_client, "TIMEOUT", 3.0)
    monkeypatch.setattr(supervisor, "METHOD", "spawn")  # earlier tests have left threads
    call = replay_client.ReplayClient.call

    def call_and_stall(client: Any, kind: Any, name: str, *arguments: Any, **options: Any) -> Any:
        answer = call(client, kind, name, *arguments, **options)
        if name == "bag_player/resume":
            os.kill(client._supervisor._processes["gait_analyzer"].pid, signal.SIGSTOP)
        return answer

    monkeypatch.setattr(replay_client.ReplayClient, "call", call_and_stall)
    options = SimpleNamespace(bag=BAG, protocol=None, side=None, rate=1.0, out=None, json=True)
    with claimed_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))  # restored after replay has set it
        with pytest.raises(NodeError, match="gait_analyzer has been silent for 3 s"):
            replay_command.replay(options, domain)


class Player:
    """A player of a bag in a probe's domain, paused at the start."""

    def __init__(self, bag: Path, domain: int, folder: Path, *parameters: str) -> None:
        arguments = ["--ros-args", "-p", f"bag:={bag}", "-p", "start_paused:=true"]
        for parameter in parameters:
            arguments += ["-p", parameter]
        self.log = folder / "player.log"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                ["bag_player", *arguments],
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            )


@pytest.fixture
def player(tmp_path: Path) -> Any:
    with claimed_domain() as domain, probe(domain) as listener:
        started: list[Player] = []

        def start(*parameters: str) -> tuple[Player, Probe]:
            started.append(Player(BAG, domain, tmp_path, *parameters))
            return started[-1], listener

        yield start
        for each in started:
            each.process.kill()
            each.process.wait()


def test_the_player_obeys_its_services(player: Any) -> None:
    process, listener = player(
        "topics:=[/gait_events]", "expect:=[/gait_events]", "stay:=true", "clock:=100.0"
    )
    heard = listener.listen(GAIT_EVENTS)
    clock = listener.listen(CLOCK)
    ask = listener.call
    events = list(payloads(BAG, ["/gait_events"])["/gait_events"])
    assert ask(srv.IsPaused, "bag_player/is_paused").paused
    assert ask(srv.GetRate, "bag_player/get_rate").rate == 1.0
    assert not ask(srv.SetRate, "bag_player/set_rate", srv.SetRate.Request(rate=-1.0)).success
    assert ask(srv.SetRate, "bag_player/set_rate", srv.SetRate.Request(rate=1e6)).success
    assert ask(srv.GetRate, "bag_player/get_rate").rate == 1e6
    # Single messages, once the expected subscription has been matched.
    listener.until(lambda: ask(srv.PlayNext, "bag_player/play_next").success, "the start")
    for _ in range(3):
        assert ask(srv.PlayNext, "bag_player/play_next").success
    listener.until(lambda: len(heard) == 4, "four events")
    # Back to the start, then on to the end.
    start = events[0][0]
    assert not ask(
        srv.Seek, "bag_player/seek", srv.Seek.Request(time=to_time(start - 10**12))
    ).success
    assert ask(srv.Seek, "bag_player/seek", srv.Seek.Request(time=to_time(start))).success
    ask(srv.TogglePaused, "bag_player/toggle_paused")
    assert not ask(srv.IsPaused, "bag_player/is_paused").paused
    listener.until(lambda: len(heard) == 4 + len(events), "all events")
    assert [e.header.stamp for e in heard[4:]] == [to_time(stamp) for stamp, _ in events]
    ticks = [tick.clock.sec * 10**9 + tick.clock.nanosec for tick in clock]
    assert start in ticks
    assert {(tick - start) % 10_000_000 for tick in ticks} == {0}
    # Paused, then on from the middle to the end.
    ask(srv.Pause, "bag_player/pause")
    assert ask(srv.IsPaused, "bag_player/is_paused").paused
    middle = to_time(events[10][0])
    assert ask(srv.Seek, "bag_player/seek", srv.Seek.Request(time=middle)).success
    ask(srv.Resume, "bag_player/resume")
    listener.until(lambda: len(heard) == 4 + 2 * len(events) - 10, "the rest of the events")
    assert heard[4 + len(events)].header.stamp == middle
    assert not ask(srv.PlayNext, "bag_player/play_next").success
    assert process.process.poll() is None


def test_nothing_is_played_without_the_expected_subscriptions(player: Any) -> None:
    process, _ = player("expect:=[/gait_events]", "expect_timeout:=0.5")
    assert process.process.wait(TIMEOUT) == 1
    assert "no subscriptions of /gait_events within 0.5 s" in process.log.read_text()


def test_a_player_reports_a_hanging_reader_and_obeys_a_signal(player: Any) -> None:
    process, listener = player("topics:=[/gait_events]", "expect:=[/gait_events]", "rate:=0.0")
    domain = str(listener.node.context.get_domain_id())
    reader = subprocess.Popen(
        ["gait_analyzer"],
        env={**os.environ, "ROS_DOMAIN_ID": domain},
    )
    try:
        listener.until(lambda: listener.call(Ready, "bag_player/ready").ready, "its subscription")
        reader.send_signal(signal.SIGSTOP)
        listener.call(srv.Resume, "bag_player/resume")
        listener.until(lambda: "does not keep up" in process.log.read_text(), "a warning")
        terminated_at = time.monotonic()
        process.process.terminate()
        assert process.process.wait(TIMEOUT) == 0
        assert time.monotonic() - terminated_at < 5
    finally:
        reader.kill()
        reader.wait()


def test_topics_are_remapped_and_played_in_a_loop(player: Any) -> None:
    process, listener = player(
        "remap:=['/gait_events:=/again/gait_events']",
        "exclude:=['/gait/*', /clock]",
        "expect:=[/again/gait_events]",
        "loop:=true",
        "rate:=0.0",
        "clock:=0.0",
    )
    heard = listener.listen(GAIT_EVENTS._replace(name="/again/gait_events"))
    listener.call(srv.Resume, "bag_player/resume")
    count = len(payloads(BAG, ["/gait_events"])["/gait_events"])
    listener.until(lambda: len(heard) > 2 * count, "the third round")
    assert heard[:count] == heard[count : 2 * count]
    topics = dict(listener.node.get_topic_names_and_types())
    assert "/joint_states" in topics
    assert not {"/gait_events", "/gait/strides", "/clock"} & topics.keys()
    process.process.terminate()
    assert process.process.wait(TIMEOUT) == 0
    assert "messages played" in process.log.read_text()


@pytest.mark.parametrize(
    ("parameter", "words"),
    [
        ("topics:=[/nothing]", "/nothing matches no topic"),
        ("rate:=-1.0", "rate: -1"),
        ("start_offset:=1e9", "start_offset"),
        ("remap:=['/nothing:=/x']", "no topic /nothing"),
        ("remap:=[gait_events]", "allowed: /from:=/to"),
        ("expect:=[/nothing]", "/nothing is not played"),
    ],
)
def test_a_wrong_parameter_gives_one_line(player: Any, parameter: str, words: str) -> None:
    process, _ = player(parameter)
    assert process.process.wait(TIMEOUT) == 2
    text = process.log.read_text()
    assert words in text
    assert text.count("\n") == 1
