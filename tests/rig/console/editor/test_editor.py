"""The editor by its keys: what is typed is in the file when it is saved, and nothing else is."""

from pathlib import Path

import pytest
from textual import events
from textual.binding import Binding
from textual.widgets import Input

from rig.console.editor.app import EditorApp
from rig.console.editor.questions import KEYS
from tests.rig.console.editor.editor_desk import CAMPAIGN, campaign_here, editing


@pytest.fixture
def path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return campaign_here()


async def test_opened_and_left_the_file_is_as_it_was(path):
    async with editing(path) as desk:
        assert "one run: " in desk.told()
        assert "102.4 N expected" in desk.told()
        assert "no earlier recording of T1" in desk.told()
        assert desk.wrong() == []
        for _ in desk.app.form.rows():
            await desk.press("tab")
        await desk.press("ctrl+s", "ctrl+q")
        assert not desk.app.is_running or desk.app._exit
    assert desk.disk == CAMPAIGN


async def test_a_value_is_typed_over_previewed_and_saved(path):
    async with editing(path) as desk:
        await desk.press("down", *"12.5")
        assert desk.text == CAMPAIGN.replace("16.0", "12.5")
        assert desk.disk == CAMPAIGN
        await desk.look()
        assert "12.5 V" in desk.told()
        assert "not saved" in desk.head()
        await desk.press("ctrl+s")
        assert desk.disk == CAMPAIGN.replace("16.0", "12.5")
        assert "[saved]" in desk.head()
        assert desk.toasts()[-1] == "saved; to run it: rig run campaign.toml"


async def test_the_dry_run_follows_when_the_typing_has_paused(path):
    async with editing(path) as desk:
        await desk.press("down", *"8")
        while "peak voltage: 8 V" not in desk.told():
            await desk.pilot.pause(0.02)


async def test_keys_of_one_burst_after_the_field_was_emptied_all_arrive(path):
    async with editing(path) as desk:
        row = await desk.enter("plan.max")
        for key, letter in (("ctrl+u", None), *((each, each) for each in "12.5")):
            desk.app.post_message(events.Key("full_stop" if key == "." else key, letter))  # none waits for another
        while row.typed != "12.5":
            await desk.pilot.pause(0.01)
        await desk.pilot.pause()
        assert desk.text == CAMPAIGN.replace("16.0", "12.5")


async def test_a_burst_over_several_fields_arrives(path):
    async with editing(path) as desk:
        row = await desk.enter("plan.max")
        keys = ["ctrl+u", *"14", "tab", *"7", "tab", *"2.5", "tab", "right", "shift+tab", "ctrl+u", *"3", "ctrl+s"]
        for key in keys:
            letter = key if len(key) == 1 else None
            desk.app.post_message(events.Key("full_stop" if key == "." else key, letter))
        while desk.app.draft.unsaved or desk.disk == CAMPAIGN:
            await desk.pilot.pause(0.02)
        assert row.typed == "14"
        expected = CAMPAIGN.replace("16.0", "14").replace("levels = 4 ", "levels = 7 ")
        assert desk.disk == expected.replace("# V/s\n", '# V/s\nmin = 3\nsides = "forward"\n\n')


async def test_typing_while_the_dry_run_is_shown_keeps_the_cursor_and_the_text(path):
    async with editing(path) as desk:
        row = await desk.enter("plan.max")
        control = row.control
        assert isinstance(control, Input)
        await desk.press("ctrl+u", *"1.")
        await desk.look()  # would show 1.0 if it took the focused field from the document
        assert control.value == "1."
        await desk.press("5", "left", "left", "2")
        await desk.look()
        assert control.value == "12.5"
        assert control.cursor_position == 2
        await desk.press("tab")
        assert desk.text == CAMPAIGN.replace("16.0", "12.5")


async def test_a_number_is_shown_as_the_file_has_it_once_its_field_is_left(path):
    async with editing(path) as desk:
        row = await desk.enter("plan.max")
        await desk.press("ctrl+u", *"12.", "tab")
        await desk.pilot.pause()
        assert row.typed == "12.0"
        assert desk.text == CAMPAIGN.replace("16.0", "12.0")


async def test_undo_goes_back_field_by_field_also_under_the_cursor(path):
    async with editing(path) as desk:
        row = await desk.enter("plan.max")
        await desk.press(*"12", "tab", *"8")
        await desk.press("ctrl+z")
        assert desk.row("plan.levels").typed == "4"
        assert desk.text == CAMPAIGN.replace("16.0", "12")
        await desk.press("ctrl+z")
        assert (row.typed, desk.text) == ("16.0", CAMPAIGN)
        await desk.press("ctrl+z")
        assert desk.toasts()[-1] == "Nothing to undo."
        await desk.press("end", "9")  # the field under the cursor takes keys again
        assert desk.text == CAMPAIGN.replace("levels = 4", "levels = 49")


@pytest.mark.parametrize(
    ("key", "typed", "said", "marked"),
    [
        ("plan.max", "30", "[plan]: step 8 (ramp) commands 30 V, but the bench", []),
        ("plan.max", "12x", "plan.max must be a number, but is '12x'", ["plan.max"]),
        ("plan.max", "0", "[plan]: max must be a number above 0 V, but is 0", ["plan.max"]),
        ("plan.levels", "2.5", "plan.levels must be a whole number, but is 2.5", ["plan.levels"]),
        ("plan.dwell.settle", "3", "[plan.dwell]: dwell.settle (3 s) must be shorter", ["plan.dwell.settle"]),
        ("campaign.thrusters", "T1, T1", "campaign.thrusters must name at least one", ["campaign.thrusters"]),
        ("campaign.bench", "no.toml", "no.toml: there is no such bench file", []),
        ("campaign.expected_C", "4", "is expected to give 1024 N (expected_C V|V|)", []),
        ("tare.duration", "0.01", "tare.duration is 0.01 s, in which", ["tare.duration"]),
    ],
)
async def test_what_is_wrong_is_told_in_the_words_of_rig_check_and_marked(path, key, typed, said, marked):
    async with editing(path) as desk:
        await desk.enter(key)
        await desk.press("ctrl+u", *typed)
        await desk.look()
        assert said in desk.told()
        assert desk.wrong() == marked
        assert "can't run yet" in desk.head()


async def test_each_field_that_holds_no_value_is_marked(path):
    async with editing(path) as desk:
        await desk.enter("plan.max")
        await desk.press("ctrl+u", *"a", "tab", "ctrl+u", *"b")
        await desk.look()
        assert desk.wrong() == ["plan.max", "plan.levels"]


async def test_another_order_shows_its_own_fields_and_turning_back_is_no_change(path):
    async with editing(path) as desk:
        await desk.press("right", "right", "right")
        shown = {row.field.dotted for row in desk.app.form.rows() if row.display}
        assert {"plan.voltages", "plan.durations"} <= shown
        assert not {"plan.max", "plan.sides", "plan.seed"} & shown
        await desk.look()
        assert desk.told() == "missing key plan.voltages (an array of numbers)"
        assert desk.wrong() == ["plan.voltages"]
        await desk.press("left", "left", "left")
        assert desk.text == CAMPAIGN
        assert desk.row("plan.max").typed == "16.0"


async def test_levels_as_a_list(path):
    async with editing(path) as desk:
        await desk.press("right", "right", "right", "tab", *"4, 0, -4")
        await desk.look()
        assert desk.app.draft.document.value(("plan", "voltages")) == [4, 0, -4]
        assert "holds: 3 at -4, 0, 4 V, 3 s at each" in desk.told()


async def test_leaving_asks_when_something_is_not_saved(path):
    async with editing(path) as desk:
        await desk.press("down", *"12", "escape")
        assert desk.answers() == ["stay", "save", "drop"]
        await desk.press("escape")
        assert desk.answers() == []
        assert desk.text == CAMPAIGN.replace("16.0", "12")
        await desk.press("ctrl+q", "right", "right", "enter")
    assert desk.disk == CAMPAIGN


async def test_leaving_with_save(path):
    async with editing(path) as desk:
        await desk.press("down", *"12", "ctrl+c", "right", "enter")
        await desk.pilot.pause()
    assert desk.disk == CAMPAIGN.replace("16.0", "12")


async def test_a_campaign_that_can_not_run_is_saved_only_when_told(path):
    async with editing(path) as desk:
        await desk.press("down", *"30", "ctrl+s")
        assert desk.answers() == ["stay", "anyway"]
        await desk.press("enter")
        assert desk.disk == CAMPAIGN
        await desk.press("ctrl+s", "right", "enter")
        await desk.pilot.pause()
        assert desk.disk == CAMPAIGN.replace("16.0", "30")


@pytest.mark.parametrize(("keys", "expected"), [(("right",), "disk"), (("right", "right"), "mine"), ((), "asked")])
async def test_a_file_that_was_changed_meanwhile_is_not_written_over_unasked(path, keys, expected):
    async with editing(path) as desk:
        await desk.press("down", *"12")
        path.write_text("# another's\n" + CAMPAIGN, encoding="utf-8")
        await desk.press("ctrl+s")
        assert desk.answers() == ["stay", "load", "overwrite"]
        await desk.press(*keys, "enter")
        await desk.pilot.pause()
        mine, others = CAMPAIGN.replace("16.0", "12"), "# another's\n" + CAMPAIGN
        assert desk.disk == (mine if expected == "mine" else others)
        assert desk.text == (others if expected == "disk" else mine)


async def test_a_file_that_can_not_be_written_is_told_and_nothing_is_lost(path):
    async with editing(path) as desk:
        await desk.press("down", *"12")
        path.unlink()
        path.mkdir()
        await desk.press("ctrl+s")
        assert desk.answers() == ["stay", "load", "overwrite"]
        await desk.press("right", "right", "enter")
        await desk.pilot.pause()
        assert desk.toasts()[-1].startswith("campaign.toml: this file can't be written: ")
        assert desk.toasts()[-1].endswith("; nothing is saved")
        assert desk.text == CAMPAIGN.replace("16.0", "12")
        assert "not saved" in desk.head()


async def test_the_stop_key_says_that_nothing_was_stopped(path):
    async with editing(path) as desk:
        await desk.press("f9")
        assert desk.toasts() == ["NOT STOPPED: the editor drives nothing. Stop in the console, or type: rig stop"]


async def test_help_opens_over_a_text_field_and_closes(path):
    async with editing(path) as desk:
        await desk.press("question_mark")
        assert len(desk.app.screen_stack) == 2
        await desk.press("escape", "down", "f1")
        assert len(desk.app.screen_stack) == 2
        await desk.press("f1")
        assert len(desk.app.screen_stack) == 1
        assert desk.text == CAMPAIGN


async def test_a_note_of_more_than_a_line_is_not_touched(path):
    text = CAMPAIGN.replace("[plan]\n", 'notes = """one\ntwo"""\n\n[plan]\n', 1)
    path.write_text(text, encoding="utf-8")
    async with editing(path) as desk:
        assert desk.row("campaign.notes").control.disabled
        await desk.press("down", *"12", "ctrl+s")
        assert desk.disk == text.replace("16.0", "12")


WORDS = {"ctrl": "Ctrl", "shift": "Shift", "pageup": "Page Up", "pagedown": "Page Down", "question_mark": "?"}
ELSEWHERE = ("super+c", "f9", "ctrl+c")
"""Keys that the dialog leaves out: told by the page, or one that few terminals pass on."""


def test_every_key_is_in_the_help_and_on_the_page():
    page = (Path(__file__).parents[4] / "docs" / "howto" / "edit.md").read_text(encoding="utf-8")
    bound = [key for each in EditorApp.BINDINGS if isinstance(each, Binding) for key in each.key.split(",")]
    assert len(bound) > 10
    for key in bound:
        told = "+".join(WORDS.get(part, part.capitalize()) for part in key.split("+"))
        assert key == "super+c" or f"`{told}`" in page, told
        assert key in ELSEWHERE or any(told in keys for keys, _ in KEYS), told
