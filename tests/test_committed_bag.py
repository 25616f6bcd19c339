# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The bag that comes with the project, read by two third-party readers."""

from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from gait_entrainment_bags import BagReader

BAG = Path(__file__).parents[1] / "bags" / "paper_example"


def counts_of(topics):
    return {topic: topics.count(topic) for topic in set(topics)}


def recorded():
    with BagReader(BAG) as bag:
        return {topic: count for topic, count in bag.counts.items() if count}


def test_rosbags_decodes_every_message():
    # A store without any messages: the definitions come from the bag alone.
    with AnyReader([BAG], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        topics = []
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            topics.append(connection.topic)
    assert counts_of(topics) == recorded()


def test_mcap_decodes_every_message():
    with (BAG / "paper_example_0.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        topics = [channel.topic for _, channel, _, _ in reader.iter_decoded_messages()]
    assert counts_of(topics) == recorded()
