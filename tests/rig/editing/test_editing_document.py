"""A value is changed and nothing else: the file byte for byte without an edit, its other lines with one."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.editing.document import Document, items_of, require_toml
from rig.editing.fields import changed, every_field, meant
from rig.errors import ConfigError

ROOT = Path(__file__).parents[3]
FILES = [*sorted((ROOT / "campaigns").glob("*.toml")), ROOT / "rig" / "first_steps" / "files" / "campaign.toml"]
FIELDS = {field.dotted: field for field in every_field()}
WRITTEN = """\
# who reads this: everybody

[campaign]
name  = 'tank'          # in quotes of its own
thrusters = [
    "T1",   # the left one
    "T2",   # the right one
]
bench="b.toml"
output = "out"

# what is measured
[plan]
kind = "levels"   # as written
voltages = [4.0, 0.0, -4.0]  # V
slew = 1e1 # V/s
dwell = { kind = "fixed", duration = 5 }   # long
"""


def lines_that_differ(before: str, after: str) -> list[str]:
    old = before.splitlines()
    return [line for line in after.splitlines() if line not in old]


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
@pytest.mark.parametrize("ends", ["\n", "\r\n"], ids=["lf", "crlf"])
def test_every_field_typed_as_it_stands_leaves_the_file_byte_for_byte(path, ends):
    text = path.read_text(encoding="utf-8").replace("\n", ends)
    require_toml(path, text)
    document = Document(text)
    seen = 0
    for field in FIELDS.values():
        written = document.written(field.key)
        if written:
            seen += 1
            document = changed(document, field, written)
    assert seen > 8
    assert document.text == text


@pytest.mark.parametrize(
    ("key", "typed", "line"),
    [
        ("campaign.name", "tank, 2", 'name  = "tank, 2"          # in quotes of its own'),
        ("campaign.bench", "c.toml", 'bench="c.toml"'),
        ("plan.slew", "12.50", "slew = 12.50 # V/s"),
        ("plan.kind", "levels", None),
        ("plan.voltages", "4.0, 0.0, 2.5, -4.0", "voltages = [4.0, 0.0, 2.5, -4.0]  # V"),
        ("plan.voltages", "-4.0", "voltages = [-4.0]  # V"),
        ("plan.dwell.duration", "6", 'dwell = { kind = "fixed", duration = 6 }   # long'),
        ("plan.repeats", "3", "repeats = 3"),
        ("campaign.thrusters", "T1, T3", '    "T3",   # the right one'),
    ],
)
def test_only_the_line_of_the_value_differs(key, typed, line):
    after = changed(Document(WRITTEN), FIELDS[key], typed).text
    assert lines_that_differ(WRITTEN, after) == ([line] if line else [])
    assert [part for part in WRITTEN.splitlines() if "#" in part and part.split("#")[1] not in after] == []


def test_a_thruster_between_two_others_keeps_their_comments():
    after = changed(Document(WRITTEN), FIELDS["campaign.thrusters"], "T1, T9, T2").text
    assert lines_that_differ(WRITTEN, after) == ['    "T9",']
    assert tomllib.loads(after)["campaign"]["thrusters"] == ["T1", "T9", "T2"]


def test_what_is_no_number_is_told_in_the_words_of_the_loader():
    document = changed(Document(WRITTEN), FIELDS["plan.slew"], "12.x")
    assert FIELDS["plan.slew"].fault(document, Path("c.toml")) == "c.toml: plan.slew must be a number, but is '12.x'"
    document = changed(Document(WRITTEN), FIELDS["plan.voltages"], "1, two")
    assert FIELDS["plan.voltages"].fault(document, Path("c.toml")).startswith("c.toml: plan.voltages")
    assert FIELDS["plan.kind"].fault(Document(WRITTEN), Path("c.toml")) == ""


@pytest.mark.parametrize(
    ("typed", "means"), [(".5", 0.5), ("12.", 12.0), ("012", 12), (" 7 ", 7), ("1e-3", 1e-3), ("-0.25", -0.25)]
)
def test_numbers_as_people_write_them(typed, means):
    assert changed(Document(WRITTEN), FIELDS["plan.slew"], typed).value(("plan", "slew")) == means


def test_an_emptied_field_takes_its_key_out_and_its_default_holds():
    document = changed(Document(WRITTEN), FIELDS["plan.slew"], "  ")
    assert document.value(("plan", "slew")) is None
    assert document.text == WRITTEN.replace("slew = 1e1 # V/s\n", "")
    assert changed(document, FIELDS["plan.slew"], "").text == document.text


def test_another_kind_takes_out_what_only_the_one_before_had():
    document = changed(Document(WRITTEN), FIELDS["plan.kind"], "staircase")
    assert document.value(("plan", "voltages")) is None
    assert {name for name, field in FIELDS.items() if meant(field, document)} >= {"plan.max", "plan.sides"}
    assert not meant(FIELDS["plan.voltages"], document)
    sine = changed(document, FIELDS["plan.kind"], "sine")
    assert meant(FIELDS["plan.amplitude"], sine)
    assert meant(FIELDS["plan.dwell.duration"], sine)  # it is in the file, so somebody may want it out


@given(st.text(max_size=30))
def test_any_text_comes_back_and_changes_one_value(typed):
    document = changed(Document(WRITTEN), FIELDS["campaign.notes"], typed)
    assert (document.value(("campaign", "notes")) or "") == (typed if typed.strip() else "")
    rest = tomllib.loads(document.text)
    rest["campaign"].pop("notes", None)
    assert rest == tomllib.loads(WRITTEN)


@given(st.lists(st.floats(-30, 30).map(lambda v: round(v, 3)), min_size=1, max_size=12))
def test_any_list_of_numbers_comes_back(volts):
    document = changed(Document(WRITTEN), FIELDS["plan.voltages"], ", ".join(map(str, volts)))
    assert document.value(("plan", "voltages")) == volts
    assert "]  # V\n" in document.text


@given(st.lists(st.text(st.characters(codec="ascii", categories=("L", "N", "P", "Zs")), min_size=1), min_size=1))
def test_names_with_commas_and_quotes_come_back(names):
    names = [name.strip() for name in names if name.strip() and name.isprintable()] or ["T"]
    document = Document(WRITTEN).with_value(("campaign", "thrusters"), str(FIELDS["campaign.thrusters"].toml("T")))
    wanted = ", ".join('"' + name.replace('"', '""') + '"' for name in names)
    document = changed(document, FIELDS["campaign.thrusters"], wanted)
    assert document.value(("campaign", "thrusters")) == names
    assert items_of(document.written(("campaign", "thrusters"))) == names


def test_what_is_no_toml_is_refused_with_a_sentence():
    with pytest.raises(ConfigError, match=r"c\.toml: not valid TOML: "):
        require_toml("c.toml", "[plan\n")


def test_a_value_of_more_than_a_line_is_left_to_a_text_editor():
    document = Document('[campaign]\nnotes = """a\nb"""\n[plan.slew]\nx = 1\n')
    assert not FIELDS["campaign.notes"].one_line(document)
    assert not FIELDS["plan.slew"].one_line(document)
    assert FIELDS["campaign.name"].one_line(document)
