"""What a browser says over its websocket."""

from __future__ import annotations

import json

import pytest

from rig.serve.messages import ALIVE, Keys, Resize, heard


def test_keys_and_sizes():
    assert heard('["stdin", "\\u001b[15~"]') == Keys(b"\x1b[15~")
    assert heard('["resize", {"width": 144, "height": 41}]') == Resize(144, 41)
    assert heard('["resize", {"width": 0, "height": 1e9}]') is None
    assert heard('["resize", {"width": -3, "height": 1000000000}]') == Resize(1, 200)
    assert heard('["stdin", "\\ud800"]') == Keys(b"?")


@pytest.mark.parametrize(
    "text",
    ["", "{", "null", "[]", '["stdin"]', '["stdin", 3]', '["resize", 3]', '["blur"]', '["quit"]', ALIVE, "[" * 100_000],
)
def test_what_is_none_of_ours_is_nothing(text):
    assert heard(text) is None


def test_a_sign_of_life_is_json_of_one_word():
    assert json.loads(ALIVE) == ["alive"]
