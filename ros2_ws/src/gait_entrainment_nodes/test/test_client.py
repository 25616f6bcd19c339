# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The client: questions repeated until the answer is acceptable, silent nodes named."""

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
def received(client):
    """Serve ~/ready in a node that is ready from the third request on; yield the requests."""
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


def test_request_is_repeated_until_the_answer_is_acceptable(client, received):
    answer = client.call(Ready, "answers/ready", accept=lambda a: a.ready, period=0.05)
    assert answer.ready
    # More may be on their way: on a busy computer an answer takes longer than the period.
    assert 2 < int(answer.waiting_for.removeprefix("answer ")) <= len(received)


def test_a_question_keeps_the_latest_answer(client, received):
    question = client.ask(Ready, "answers/ready", accept=lambda _: False, period=0.05)
    assert client.wait(lambda: question.answer() or len(received) > 1, 10)
    assert question.answer() is None
    assert question.latest.waiting_for.startswith("answer")
    assert question.answered_at > 0


def test_waiting_to_be_known_leaves_no_further_requests(client, received):
    client.wait_to_be_known("answers", timeout=10)
    before = len(received)
    assert client.call(Ready, "answers/ready", period=float("inf")).waiting_for
    assert len(received) == before + 1


def test_a_silent_node_is_named(client):
    with pytest.raises(SilenceError, match=r"nobody/ready within 0\.1 s") as error:
        client.call(Ready, "nobody/ready", timeout=0.1)
    assert error.value.node == "nobody"
    assert error.value.exit_code == 1


def test_each_round_can_end_a_wait(client):
    rounds = count()

    def end():
        if next(rounds) > 2:
            raise KeyError

    client.each_round = end
    with pytest.raises(KeyError):
        client.wait(lambda: False, 10)


def test_wait_returns_the_last_value_even_if_it_is_false(client):
    assert client.wait(lambda: "there") == "there"
    assert client.wait(list, 0.01) == []
