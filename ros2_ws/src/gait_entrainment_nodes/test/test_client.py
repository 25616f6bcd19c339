# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The client: questions repeated until the answer is acceptable, silence told by name."""

import threading
from itertools import count

import pytest

from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.errors import SilenceError


@pytest.fixture
def client():
    with claimed_domain() as domain, Client("asks", domain=domain) as made:
        yield made


@pytest.fixture
def asked(client):
    """Serve ~/ready by a node that succeeds at the third request; return the requests so far."""
    requests = []
    over = threading.Event()

    def answer(request, response):
        requests.append(request)
        response.ready, response.waiting_for = len(requests) > 2, f"answer {len(requests)}"
        return response

    def serve(domain):
        with Client("answers", domain=domain) as server:
            server.node.create_service(Ready, "~/ready", answer)
            server.wait(over.is_set)

    thread = threading.Thread(target=serve, args=[client.node.context.get_domain_id()])
    thread.start()
    yield requests
    over.set()
    thread.join()


def test_is_asked_until_the_answer_is_acceptable(client, asked):
    answer = client.call(Ready, "answers/ready", accept=lambda a: a.ready, period=0.05)
    assert answer.ready
    # Others may be on their way: on a busy computer an answer takes longer than the period.
    assert 2 < int(answer.waiting_for.removeprefix("answer ")) <= len(asked)


def test_a_question_keeps_the_latest_answer(client, asked):
    question = client.ask(Ready, "answers/ready", accept=lambda _: False, period=0.05)
    assert client.wait(lambda: question.answer() or len(asked) > 1, 10)
    assert question.answer() is None
    assert question.latest.waiting_for.startswith("answer")
    assert question.answered_at > 0


def test_waits_to_be_known_without_asking_for_more(client, asked):
    client.wait_to_be_known("answers", timeout=10)
    before = len(asked)
    assert client.call(Ready, "answers/ready", period=float("inf")).waiting_for
    assert len(asked) == before + 1


def test_silence_is_told_by_name(client):
    with pytest.raises(SilenceError, match=r"nobody/ready within 0\.1 s") as error:
        client.call(Ready, "nobody/ready", timeout=0.1)
    assert error.value.node == "nobody"
    assert error.value.exit_code == 1


def test_each_round_can_end_the_waiting(client):
    rounds = count()

    def end():
        if next(rounds) > 2:
            raise KeyError

    client.each_round = end
    with pytest.raises(KeyError):
        client.wait(lambda: False, 10)


def test_waiting_returns_the_value_or_what_is_false(client):
    assert client.wait(lambda: "there") == "there"
    assert client.wait(list, 0.01) == []
