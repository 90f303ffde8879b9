"""Who gets in: pure, with secrets that are known."""

from __future__ import annotations

from dataclasses import replace
from itertools import count

import pytest

from rig.serve.guard import NO_COOKIE, Asked, Guard

SERVED = frozenset({"127.0.0.1:8000", "localhost:8000"})


@pytest.fixture
def guard() -> Guard:
    numbers = count()
    return Guard(lambda: f"secret-{next(numbers)}")


def let_in(guard: Guard) -> Asked:
    """A websocket as our own page opens it."""
    cookie = guard.exchange(guard.new_token())
    assert cookie is not None
    path = f"{guard.room}ws"
    return Asked("GET", path, "127.0.0.1:8000", "http://127.0.0.1:8000", cookie, websocket=True)


def test_the_token_is_used_up_and_gives_another_secret(guard):
    token = guard.new_token()
    cookie = guard.exchange(token)
    assert cookie not in (None, token, guard.room)
    assert guard.exchange(token) is None
    assert guard.exchange(cookie) is None
    assert guard.exchange("") is None
    assert guard.exchange(token[:-1]) is None
    assert guard.exchange("\udcff ü") is None


def test_each_link_lets_in_one_browser_more(guard):
    first, second = guard.new_token(), guard.new_token()
    cookies = {guard.exchange(second), guard.exchange(first)}
    assert len(cookies) == 2
    for cookie in cookies:
        assert guard.refusal(replace(let_in(guard), cookie=cookie), SERVED) == ""


def test_our_own_page_is_let_through_under_each_name(guard):
    asked = let_in(guard)
    assert guard.refusal(asked, SERVED) == ""
    assert guard.refusal(replace(asked, host="LocalHost:8000", origin="http://localhost:8000"), SERVED) == ""
    assert guard.refusal(replace(asked, websocket=False, origin=None), SERVED) == ""


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"cookie": ""}, NO_COOKIE),
        ({"cookie": "secret-0"}, NO_COOKIE),
        ({"origin": None}, "Origin"),
        ({"origin": "null"}, "a page of 'null'"),
        ({"origin": "http://127.0.0.1:8001"}, "a page of 'http://127.0.0.1:8001'"),
        ({"origin": "https://127.0.0.1:8000"}, "a page of"),
        ({"origin": "http://localhost:8000"}, "a page of"),
        ({"origin": "http://127.0.0.1:8000.evil.example"}, "a page of"),
        ({"host": "evil.example:8000", "origin": "http://evil.example:8000"}, "for the host 'evil.example:8000'"),
        ({"host": "127.0.0.1:8001", "origin": "http://127.0.0.1:8001"}, "for the host"),
        ({"host": ""}, "for the host ''"),
        ({"path": "/"}, NO_COOKIE),
        ({"method": "POST"}, "'POST'"),
        ({"method": "POST", "origin": None}, "Origin"),
    ],
)
def test_what_is_refused_and_why(guard, changes, why):
    asked = let_in(guard)
    if changes == {"path": "/"}:
        changes = {"path": "/", "cookie": ""}  # no websocket where links are exchanged
    assert why in guard.refusal(replace(asked, **changes), SERVED)


def test_what_is_told_of_a_stranger_is_short_and_one_line(guard):
    said = guard.refusal(replace(let_in(guard), origin="http://x\n\x1b[2J" + "y" * 10_000), SERVED)
    assert said.isprintable()
    assert len(said) < 250


def test_secrets_are_long_and_of_no_use_twice():
    one, two = Guard(), Guard()
    words = [one.room, two.room, one.new_token(), one.new_token()]
    assert len({*words}) == 4
    assert min(map(len, words)) >= 43  # 32 bytes in base64
