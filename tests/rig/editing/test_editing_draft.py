"""A draft: what is undone, what is saved, and what is not written over."""

import os
import stat

import pytest

from rig.editing.draft import Draft
from rig.editing.fields import every_field
from rig.editing.saving import ChangedOnDiskError, opened, saved
from rig.errors import ConfigError

FIELDS = {field.dotted: field for field in every_field()}
MAX, SLEW = FIELDS["plan.max"], FIELDS["plan.slew"]
TEXT = '[plan]\nkind = "ramp"\nmax = 16.0   # V, the driver\'s\nslew = 10.0\n'


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "campaign.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_a_field_that_is_emptied_and_typed_anew_keeps_its_place_and_its_comment(path):
    draft = Draft(opened(path))
    for text in ("16.0", "", "1", "12", "12.", "12.5"):
        draft.type(MAX, text, "16.0")
    assert draft.document.text == TEXT.replace("16.0", "12.5")


def test_typing_into_one_field_is_undone_at_once_and_fields_one_by_one(path):
    draft = Draft(opened(path))
    for text in ("1", "12"):
        draft.type(MAX, text, "16.0")
    draft.type(SLEW, "5", "10.0")
    assert draft.undo()
    assert draft.document.text == TEXT.replace("16.0", "12")
    assert draft.undo()
    assert draft.document.text == TEXT
    assert not draft.unsaved
    assert not draft.undo()


def test_typing_back_what_stood_there_is_no_change(path):
    draft = Draft(opened(path))
    draft.type(MAX, "1", "16.0")
    assert draft.unsaved
    draft.type(MAX, "16.0", "16.0")
    assert not draft.unsaved
    assert not draft.undo()


def test_saving_writes_the_document_and_keeps_permissions_and_links(path, tmp_path):
    path.chmod(0o640)
    link = tmp_path / "link.toml"
    link.symlink_to(path.name)
    draft = Draft(opened(link))
    draft.type(MAX, "9", "16.0")
    draft.save()
    assert not draft.unsaved
    assert link.is_symlink()
    assert path.read_text(encoding="utf-8") == TEXT.replace("16.0", "9")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert sorted(each.name for each in tmp_path.iterdir()) == ["campaign.toml", "link.toml"]
    assert draft.undo()  # of what was saved too
    assert draft.unsaved


def test_saving_nothing_leaves_the_file_byte_for_byte(tmp_path):
    path = tmp_path / "c.toml"
    content = TEXT.replace("\n", "\r\n").encode()
    path.write_bytes(content)
    draft = Draft(opened(path))
    draft.save()
    assert path.read_bytes() == content


def test_a_file_that_another_program_has_written_is_not_overwritten(path):
    draft = Draft(opened(path))
    draft.type(MAX, "9", "16.0")
    path.write_text("# somebody's\n" + TEXT, encoding="utf-8")
    with pytest.raises(ChangedOnDiskError, match="another program has changed this file"):
        draft.save()
    assert path.read_text(encoding="utf-8").startswith("# somebody's")
    draft.load_again()
    assert draft.document.text == "# somebody's\n" + TEXT
    assert draft.undo()  # what was typed is not lost
    assert draft.document.text == TEXT.replace("16.0", "9")
    draft.save()
    assert path.read_text(encoding="utf-8") == TEXT.replace("16.0", "9")


def test_a_file_that_was_taken_away_is_written_only_when_told(path):
    file = opened(path)
    path.unlink()
    with pytest.raises(ChangedOnDiskError):
        saved(file, "x = 1\n")
    assert not path.exists()
    saved(file, "x = 1\n", anyway=True)
    assert path.read_text(encoding="utf-8") == "x = 1\n"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_takes_no_file_is_told(path):
    file = opened(path)
    path.parent.chmod(0o500)
    try:
        with pytest.raises(ConfigError, match="can't be written: Permission denied; nothing is saved"):
            saved(file, "x = 1\n")
    finally:
        path.parent.chmod(0o700)


def test_a_folder_that_is_gone_is_told(tmp_path):
    folder = tmp_path / "campaigns"
    folder.mkdir()
    (folder / "c.toml").write_text(TEXT, encoding="utf-8")
    file = opened(folder / "c.toml")
    (folder / "c.toml").unlink()
    folder.rmdir()
    with pytest.raises(ConfigError, match="can't be written: No such file or directory; nothing is saved"):
        saved(file, "x = 1\n", anyway=True)


@pytest.mark.parametrize(
    ("content", "why"), [(b"\xff", "can't be read"), (None, "there is no such campaign file"), (b"[", "not valid TOML")]
)
def test_what_can_not_be_edited_is_one_sentence(tmp_path, content, why):
    path = tmp_path / "c.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match=why):
        Draft(opened(path))
