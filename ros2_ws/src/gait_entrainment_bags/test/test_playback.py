# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import math
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_bags import (
    FASTEST,
    BagError,
    BagReader,
    BagWriter,
    Playback,
    TopicInfo,
    choose_topics,
)

SECOND = 10**9
START = 100 * SECOND


def write(folder, instants):
    """Write a one-byte message per instant [ns from the start], alternating between two topics."""
    with BagWriter(folder, ros_distro="jazzy") as writer:
        for name in ("/a", "/b/c"):
            writer.add_topic(TopicInfo(name, "p/msg/C", "byte b\n"))
        for number, instant in enumerate(instants):
            data = bytes([0, 1, 0, 0, number % 256])
            writer.write("/a" if number % 2 == 0 else "/b/c", data, START + instant, 0)
    return folder


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Read a bag of ten messages, one second apart."""
    folder = write(tmp_path_factory.mktemp("bags") / "ten", [n * SECOND for n in range(10)])
    with BagReader(folder) as reader:
        yield reader


def playback(bag, **options):
    return Playback(bag, list(bag.topics), **options)


def played(playing, until, step=SECOND // 4, begin=0):
    """Return (steady time, instant from the start) of everything played up to a time [ns]."""
    taken = []
    for now in range(begin, until + 1, step):
        while moment := playing.take(now):
            taken.append((now, moment.instant - START))
    return taken


@pytest.mark.parametrize("rate", [0.5, 1.0, 4.0])
def test_each_message_is_due_at_its_time_divided_by_the_rate(bag, rate):
    playing = playback(bag, rate=rate)
    playing.begin(7)
    for n in range(10):
        due = playing.due()
        assert due == 7 + round(n * SECOND / rate)
        assert playing.take(due - 1) is None
        assert playing.take(due).instant == START + n * SECOND
    assert playing.ended
    assert playing.due() is None


def test_a_late_call_delays_no_later_message(bag):
    playing = playback(bag)
    playing.begin(0)
    late = 3 * SECOND + 5
    assert [playing.take(late).instant - START for _ in range(4)] == [n * SECOND for n in range(4)]
    assert playing.take(late) is None
    assert playing.due() == 4 * SECOND


def test_the_fastest_rate_plays_everything_immediately(bag):
    playing = playback(bag, rate=FASTEST)
    playing.begin(5)
    assert len(played(playing, 5, begin=5)) == 10


def test_a_pause_delays_everything_after_it(bag):
    playing = playback(bag)
    playing.begin(0)
    played(playing, 2 * SECOND)
    playing.pause(2 * SECOND + 400)
    playing.pause(3 * SECOND)
    assert playing.due() is None
    assert playing.instant(50 * SECOND) == START + 2 * SECOND + 400
    playing.resume(100 * SECOND)
    playing.resume(101 * SECOND)
    assert playing.due() == 100 * SECOND + SECOND - 400


def test_a_changed_rate_applies_from_then_on(bag):
    playing = playback(bag)
    playing.begin(0)
    played(playing, 2 * SECOND)
    playing.set_rate(10.0, 2 * SECOND + SECOND // 2)
    assert playing.due() == 2 * SECOND + SECOND // 2 + SECOND // 20
    playing.set_rate(FASTEST, 3 * SECOND)
    assert len(played(playing, 3 * SECOND, begin=3 * SECOND)) == 7


def test_seeking_works_in_both_directions_within_the_selection(bag):
    playing = playback(bag, start_offset=1.0, duration=6.0)
    playing.begin(0)
    playing.seek(START + 5 * SECOND - 7, 10)
    assert playing.due() == 10 + 7
    assert playing.take(17).instant == START + 5 * SECOND
    playing.seek(START + SECOND, 20)
    assert playing.take(20).instant == START + SECOND
    for outside in (START, START + 7 * SECOND):
        with pytest.raises(BagError, match="allowed"):
            playing.seek(outside, 30)
    assert playing.due() == 20 + SECOND
    playing.stop()
    assert playing.ended
    playing.seek(START + 6 * SECOND, 40)
    assert [instant for _, instant in played(playing, 40, begin=40)] == [6 * SECOND]


def test_offset_and_duration_select_what_is_played(bag):
    playing = playback(bag, start_offset=2.5, duration=4.0)
    playing.begin(0)
    assert [instant for _, instant in played(playing, 20 * SECOND)] == [
        n * SECOND for n in (3, 4, 5, 6)
    ]


def test_a_loop_returns_to_its_start_without_drift(bag):
    playing = playback(bag, start_offset=7.0, loop=True)
    playing.begin(0)
    taken = played(playing, 10 * SECOND, step=SECOND // 4)
    assert [instant // SECOND for _, instant in taken[:7]] == [7, 8, 9, 7, 8, 9, 7]
    # A round lasts two seconds: its last message and the first of the next are due together.
    assert [now // SECOND for now, _ in taken[:7]] == [0, 1, 2, 2, 3, 4, 4]


def test_single_messages_can_be_played_while_paused(bag):
    playing = playback(bag, paused=True)
    playing.begin(0)
    assert playing.take(10 * SECOND) is None
    assert [playing.take_next().instant - START for _ in range(3)] == [0, SECOND, 2 * SECOND]
    playing.resume(50 * SECOND)
    assert playing.due() == 51 * SECOND
    assert playing.take_next() is None
    playing.pause(50 * SECOND)
    while playing.take_next():
        pass
    assert playing.ended


def test_clock_ticks_are_at_fixed_times(bag):
    ticks = {}
    for rate in (0.5, 3.0, FASTEST):
        playing = playback(bag, rate=rate, clock_period=0.4)
        playing.begin(0)
        order = []
        while not playing.ended:
            moment = playing.take(10**15)
            order.append((moment.instant - START, moment.message is None))
        assert order == sorted(order, key=lambda entry: (entry[0], not entry[1]))
        ticks[rate] = [instant for instant, is_tick in order if is_tick]
    assert ticks[0.5] == ticks[3.0] == ticks[FASTEST] == [n * 400_000_000 for n in range(23)]


def test_clock_ticks_in_a_gap_of_years_are_skipped(tmp_path):
    years = 10**9 * SECOND
    with BagReader(write(tmp_path / "bag", [0, SECOND, years + SECOND // 2])) as bag:
        playing = playback(bag, rate=FASTEST, clock_period=1.0)
        playing.begin(0)
        taken = [instant for _, instant in played(playing, 0)]
    assert taken == [0, 0, SECOND, SECOND, years, years + SECOND // 2]


@settings(derandomize=True, deadline=None, max_examples=25)
@given(
    instants=st.lists(st.integers(0, 3 * SECOND), min_size=1, max_size=1200),
    requests=st.lists(
        st.tuples(st.sampled_from(["pause", "resume", "slow", "fast"]), st.integers(0, SECOND)),
        max_size=8,
    ),
)
def test_every_message_is_played_once_in_order_whatever_is_requested(
    tmp_path_factory, instants, requests
):
    folder = write(tmp_path_factory.mktemp("bags") / "any", instants)
    with BagReader(folder) as bag:
        playing = playback(bag)
        playing.begin(0)
        now, taken = 0, []

        def take_all():
            while moment := playing.take(now):
                taken.append(moment.message)

        for request, wait in requests:
            now += wait
            take_all()
            if request in ("pause", "resume"):
                getattr(playing, request)(now)
            else:
                playing.set_rate({"slow": 0.3, "fast": 50.0}[request], now)
        playing.resume(now)
        now += 10 * 3 * SECOND
        take_all()
        assert taken == list(bag.messages())
        assert playing.ended


def test_a_playback_whose_messages_are_not_taken_can_be_stopped(tmp_path):
    with BagReader(write(tmp_path / "long", range(20_000))) as bag:
        playing = playback(bag)
        playing.begin(0)
        playing.take(0)
        playing.stop()  # does not hang on messages that were read ahead
        assert playing.take(SECOND) is None


def test_damage_is_reported_when_it_is_read(tmp_path):
    folder = write(tmp_path / "broken", range(20_000))
    file = folder / "broken_0.mcap"
    content = bytearray(file.read_bytes())
    content[content.index(b"zstd") + 100] ^= 255  # within the compressed messages
    file.write_bytes(content)
    with BagReader(folder) as bag, pytest.raises(BagError, match="at byte"):
        playback(bag)


def test_topics_are_chosen_by_name_or_pattern(bag):
    assert choose_topics(bag) == ["/a", "/b/c"]
    assert choose_topics(bag, ["/b/*"]) == ["/b/c"]
    assert choose_topics(bag, [], ["/b/*"]) == ["/a"]
    assert choose_topics(bag, ["/*"], ["/a"]) == ["/b/c"]
    with pytest.raises(BagError, match="/d"):
        choose_topics(bag, ["/d"])
    playing = Playback(bag, ["/b/c"])
    playing.begin(0)
    assert Counter(n // SECOND % 2 for _, n in played(playing, 20 * SECOND)) == {1: 5}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rate": 0.0}, "rate: 0"),
        ({"rate": -1.0}, "rate: -1"),
        ({"rate": math.nan}, "rate: nan"),
        ({"start_offset": 9.1}, "start_offset: 9.1 s; allowed: 0 to 9 s"),
        ({"start_offset": -1.0}, "start_offset"),
        ({"duration": 0.0}, "duration: 0"),
    ],
)
def test_a_number_out_of_range_is_refused(bag, options, words):
    with pytest.raises(BagError, match=words):
        playback(bag, **options)


def test_an_empty_bag_and_an_absent_topic_are_refused(bag, tmp_path):
    with pytest.raises(BagError, match="no topic /d"):
        Playback(bag, ["/d"])
    with (
        BagReader(write(tmp_path / "empty", [])) as empty,
        pytest.raises(BagError, match="no message"),
    ):
        playback(empty)
