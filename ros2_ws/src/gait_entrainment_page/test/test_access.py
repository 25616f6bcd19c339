# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The gate and the seat: who gets in, and who may act."""

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gait_entrainment.errors import UsageError
from gait_entrainment_page.access import (
    ACT,
    LONGEST_NOTE,
    LOOK,
    Access,
    Seat,
    listen,
    one_line,
)
from gait_entrainment_page.server import Gate

TOKEN, LOOK_TOKEN = "letmeactnow", "letmelooknow"
HERE = {"host": "127.0.0.1:8080"}
FAR = Access("0.0.0.0", {TOKEN: ACT, LOOK_TOKEN: LOOK})


def request(access, headers, query="", kind="http", method="GET", path="/"):
    """Send a request through a gate; return status, headers, and the scope behind it."""
    sent, passed = [], []

    async def app(scope, receive, send):
        del receive
        passed.append(scope)
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message):
        sent.append(message)

    scope = {
        "type": kind, "path": path, "query_string": query.encode(), "method": method,
        "headers": [(k.encode(), v.encode()) for k, v in headers.items()],
    }  # fmt: skip
    asyncio.run(Gate(app, access, 8080)(scope, None, send))
    first = sent[0]
    answered = [(k.decode(), v.decode()) for k, v in first.get("headers", [])]
    return first.get("status", first["type"]), answered, passed[0] if passed else None


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:8080", "[::1]:8080"])
def test_this_host_may_look_and_act_but_not_in_a_frame_of_another_page(host):
    status, headers, scope = request(Access.of("127.0.0.1"), {"host": host})
    assert (status, scope["state"]["role"]) == (200, ACT)
    assert ("x-frame-options", "DENY") in headers


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example:8080"},  # a name that resolves to this host
        HERE | {"origin": "http://evil.example"},
        HERE | {"origin": "null"},
        HERE | {"origin": "http://127.0.0.1:9999"},
        HERE | {"origin": "http://["},
        {"host": "[::1"},
        HERE | {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"},
        {},
    ],
)
@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_no_other_site_gets_through(headers, kind):
    status, _, scope = request(Access.of("127.0.0.1"), headers, kind=kind, method="POST")
    assert status == (403 if kind == "http" else "websocket.close")
    assert scope is None


def test_a_link_on_another_site_may_lead_here():
    headers = HERE | {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}
    assert request(Access.of("127.0.0.1"), headers)[0] == 200


@pytest.mark.parametrize("query", ["", "token=x", "token=a;%20Path=/x"])
def test_a_known_browser_keeps_its_seat_whatever_other_cookies_it_has(query):
    others = 'theme={"dark": true}; bare; a[b]=1; path=/; session="x y'
    known = HERE | {"cookie": f"{others}; entrain_page_browser_8080=me"}
    status, headers, scope = request(Access.of("127.0.0.1"), known, query)
    assert (status, scope["state"]["browser"]) == (200, "me")
    assert "set-cookie" not in dict(headers)


def test_host_names_are_case_insensitive(monkeypatch):
    monkeypatch.setattr("socket.gethostname", lambda: "Lab-PC")
    far = Access.of("0.0.0.0", TOKEN)
    assert far.addresses(8080)[1][1] == f"http://Lab-PC:8080/?token={TOKEN}"
    assert request(far, {"host": "Lab-PC:8080"}, f"token={TOKEN}")[0] == 303


def test_other_hosts_need_a_token_once():
    far = {"host": "10.0.0.7:8080"}
    assert request(FAR, far)[0] == 401
    assert request(FAR, far, "token=nonsense")[0] == 401
    assert request(FAR, far, kind="websocket")[0] == "websocket.close"
    for token, role in ((TOKEN, ACT), (LOOK_TOKEN, LOOK)):
        status, headers, scope = request(FAR, far, f"token={token}", path="//evil.example/")
        assert (status, scope) == (303, None)  # the token is removed from the address
        cookie = dict(headers)["set-cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=Lax" in cookie
        assert dict(headers)["location"] == "/"
        _, _, scope = request(FAR, far | {"cookie": cookie.partition(";")[0]})
        assert scope["state"]["role"] == role


def test_tokens_are_generated_if_not_given_and_short_ones_are_refused():
    made = [Access.of("0.0.0.0").tokens for _ in range(2)]
    assert made[0].keys().isdisjoint(made[1])
    assert all(len(token) >= 16 for tokens in made for token in tokens)
    with pytest.raises(UsageError, match="--token: allowed: at least 8"):
        Access.of("127.0.0.1", "short")


def test_a_port_in_use_is_reported():
    with listen("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(UsageError, match=f"--port: {port} is taken"):
            listen("127.0.0.1", port)


def test_one_browser_acts_until_another_takes_over():
    seat = Seat(timeout=100.0)
    seat.heard("a", watching=True)
    seat.heard("b", watching=True)
    assert (seat.holder, seat.watched) == ("a", True)
    seat.heard("b", watching=False)
    assert seat.watched
    seat.heard("a", watching=False)
    seat.heard("b", watching=True)
    assert (seat.holder, seat.watched) == ("a", False)
    seat.take("b")
    assert (seat.holder, seat.watched) == ("b", True)
    seat.heard("b", watching=False)
    assert not seat.watched


@given(st.text())
def test_a_note_is_one_printable_line(text):
    line = one_line(text)
    assert line.isprintable()
    assert len(line) <= LONGEST_NOTE
    assert one_line(line) == line
