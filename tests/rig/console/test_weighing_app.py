"""The wizard's screen by itself: what it shows at 80 x 24, and what its keys answer."""

import asyncio
from dataclasses import replace

import pytest
from textual.widgets import Static

from rig.console.weighing.app import WeighingApp
from rig.console.weighing.shown import StepLine, Weighing, instruction, keys_of, table

STEPS = tuple(
    StepLine(
        k + 1,
        f"{k}kg",
        9.8 * k,
        "read" if k < 3 else "now" if k == 3 else "waiting",
        *((9.8 * k, 0.01) if k < 3 else ()),
    )
    for k in range(40)
)
ASKING = Weighing(
    "rig calibrate  bench.toml", STEPS, 3, asks="hang 3kg (29.4 N)", reading=19.6, scatter=0.02, weights=("1kg", "2kg")
)
DOUBTING = replace(ASKING, asks="", doubt="step 2: 1kg was stated, but the reading says 19.6 N", probable="2kg")
ENDED = replace(ASKING, asks="", ended=True, result=tuple(f"line {k}" for k in range(60)))


class Held:
    """What is shown, and what was answered."""

    def __init__(self, now):
        self.now, self.answers = now, []

    def app(self, **how):
        return WeighingApp(lambda: self.now, self.answers.append, **how)


def pressed(now, *keys, size=(80, 24), **how):
    """(answers, text of the screen) after these keys."""
    held = Held(now)

    async def go():
        app = held.app(**how)
        async with app.run_test(size=size) as pilot:
            for key in keys:
                await pilot.press(key)
            await pilot.pause(0.15)
            return {
                each.id: str(each.render()) for each in app.screen_stack[0].query(Static) if each.id
            }, app.is_running

    shown, running = asyncio.run(go())
    return held.answers, shown, running


@pytest.mark.parametrize(("key", "answer"), [("enter", "go"), ("r", "again"), ("s", "skip"), ("k", None), ("o", None)])
def test_keys_where_a_load_is_asked_for(key, answer):
    answers, shown, _ = pressed(ASKING, key)
    assert answers == ([answer] if answer else [])
    assert shown["do"] == "Hang 3kg (29.4 N), then Enter."
    assert "19.6000 N" in shown["live"]


@pytest.mark.parametrize(
    ("key", "answer"), [("enter", None), ("r", "again"), ("k", "keep"), ("o", "probable"), ("s", None)]
)
def test_keys_where_a_step_is_doubted(key, answer):
    answers, shown, _ = pressed(DOUBTING, key)
    assert answers == ([answer] if answer else [])
    assert "o it was 2kg" in shown["keys"]


def test_other_weights_are_typed_and_a_wrong_name_is_said():
    answers, _, _ = pressed(ASKING, "e", *"2kg", "space", "plus", "space", *"1kg", "enter")
    assert answers == ["hung 2kg + 1kg"]
    answers, _, _ = pressed(ASKING, "e", *"3kg", "enter")
    assert answers == []
    answers, _, _ = pressed(ASKING, "e", *"3kg", "enter", "escape", "enter")
    assert answers == ["go"], "after Escape the keys are the screen's again"


def test_back_goes_to_what_was_read_only():
    assert pressed(ASKING, "b", "2", "enter")[0] == ["back 2"]
    assert pressed(ASKING, "b", "9", "enter")[0] == []


def test_the_end_is_asked_for_and_q_at_the_end_leaves():
    assert pressed(ASKING, "q", "enter")[0] == [], "the first answer is to go on"
    assert pressed(ASKING, "q", "right", "enter")[0] == ["stop"]
    answers, _, running = pressed(ENDED, "q")
    assert (answers, running) == ([], False)


def test_where_nothing_was_begun_the_screen_goes_by_itself():
    assert pressed(replace(ENDED, failed=True, leaves=True))[2] is False


def test_the_step_of_now_is_on_the_screen_also_of_a_long_plan():
    far = replace(ASKING, at=35, steps=tuple(replace(s, state="now") if s.number == 36 else s for s in STEPS))
    _, shown, _ = pressed(far)
    assert ">    36" in shown["table"]
    assert len(table(far, 5)) == 5


@pytest.mark.parametrize("colors", ["16", "none"])
def test_few_colors_show_the_same_words(colors):
    assert pressed(DOUBTING, colors=colors)[1]["do"] == pressed(DOUBTING)[1]["do"]


def test_what_stands_there_by_itself():
    assert instruction(Weighing("t")) == "Opening the load cell ..."
    assert instruction(replace(ENDED, failed=True)) == "Calibration failed."
    assert keys_of(ENDED) == "Up, Down scroll   q leave"
    assert len(keys_of(ASKING)) <= 2 * 78


def test_the_bell_rings_once_for_each_question(monkeypatch):
    rung = []
    monkeypatch.setattr(WeighingApp, "bell", lambda self: rung.append(self.now.asks or self.now.doubt))
    held = Held(Weighing("t"))

    async def go():
        async with held.app().run_test(size=(80, 24)) as pilot:
            for now in (ASKING, ASKING, DOUBTING):
                held.now = now
                await pilot.pause(0.25)

    asyncio.run(go())
    assert rung == [ASKING.asks, DOUBTING.doubt]
