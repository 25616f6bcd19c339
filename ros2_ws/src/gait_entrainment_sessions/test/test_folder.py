# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A session's folder: resumed where it stopped, never overwritten, sealed and unsealed."""

import json

import pytest

from gait_entrainment_sessions import folder as folder_module
from gait_entrainment_sessions.folder import SessionFolder
from gait_entrainment_sessions.runs import is_sealed
from gait_entrainment_sessions.session_file import SessionError, read_session

BLIND = ("rest: 30", "blind: true")


@pytest.fixture
def begin(write, tmp_path):
    """Return a function that starts or resumes a session."""
    return lambda *replaced: SessionFolder.begin(tmp_path / "s", read_session(write(*replaced)))


def test_a_session_is_resumed_at_the_first_block_that_is_not_done(begin):
    folder = begin()
    assert folder.path.parts[-2:] == ("sub-P01", "ses-1")
    assert folder.next_block() == 1
    folder.note("begun", 1, "block-01")
    folder.note("failed", 1, "block-01", "it\tbroke\noff")
    assert begin().next_block() == 1
    folder.note("done", 1, "block-01_run-2")
    assert begin().next_block() == 2
    assert folder.runs() == {1: folder.path / "bags/block-01_run-2"}
    assert [entry.text for entry in folder.ledger] == ["", "it broke off", ""]
    assert folder.repeat("why", 1) == 1
    folder.note("done", 2, "block-02")
    assert begin().next_block() == 1
    folder.note("done", 1, "block-01_run-3")
    assert begin().next_block() is None
    assert list(folder.runs()) == [1, 2]


def test_no_bag_is_overwritten(begin):
    folder = begin()
    for name in ("block-02", "block-02_run-2", "block-02_run-3"):
        bag = folder.new_bag(2)
        assert bag.name == name
        bag.mkdir(parents=True)


def test_a_line_truncated_by_a_crash_is_ignored_and_spoils_no_other(begin):
    folder = begin()
    folder.note("done", 1, "block-01")
    with (folder.path / "ledger.tsv").open("ab") as file:
        file.write("2026-11-26T10:00:00\tdone\t\N{BALLOT X}".encode()[:-1])
    assert folder.next_block() == 2
    folder.note("note", text="after it")
    assert [entry.what for entry in folder.ledger] == ["done", "note"]


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [("count: 20", "count: 30", 9), ("name: slower", "name: slow", 15), ("left", "right", 7)],
)
def test_a_changed_session_is_not_resumed(begin, old, new, line):
    begin()
    with pytest.raises(SessionError) as error:
        begin((old, new))
    assert f"session.yaml:{line}: " in str(error.value)
    assert "when the session began" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_session_whose_protocol_file_was_changed_is_not_resumed(begin, write):
    by_file = ("{pulses: {period: 1.9, torque_fraction: 0.1}}", "slower.yaml")
    protocol = write().parent / "slower.yaml"
    protocol.write_text("pulses: {period: 1.9}\n")
    begin(by_file)
    begin(by_file)
    protocol.write_text("pulses: {period: 1.8}\n")
    with pytest.raises(SessionError, match=r"session.yaml:15: protocol: that of slower is not"):
        begin(by_file)


def test_other_files_in_the_folder_are_left_alone(begin, tmp_path):
    (tmp_path / "s/sub-P01/ses-1").mkdir(parents=True)
    (tmp_path / "s/sub-P01/ses-1/mine").touch()
    with pytest.raises(SessionError, match="holds something else"):
        begin()


@pytest.mark.parametrize("last", ["key.json", "session.yaml", "ledger.tsv", "session.part"])
def test_a_session_interrupted_while_starting_starts_again(begin, monkeypatch, last):
    def cut(path, text):
        path.write_text(text[: 0 if path.name == last else None])
        if path.name == last:
            raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(folder_module, "_write", cut)
        with pytest.raises(OSError, match="No space"):
            begin(BLIND)
    assert begin(BLIND).next_block() == 1
    assert begin(BLIND).unblind() == ["faster", "slower"]


@pytest.mark.parametrize("other", [("code: P01", "code: P02"), ("number: 2", "number: 3")])
def test_each_person_of_a_study_has_one_number(begin, other):
    begin()
    with pytest.raises(SessionError, match=r"person.number: . of P0.; allowed: one number for"):
        begin(other, ('session: "1"', 'session: "2"'))
    begin(("code: P01, number: 2", "code: P02, number: 3"))


def test_two_processes_cannot_conduct_the_same_session(begin):
    folder = begin()
    with (
        folder.held(),
        pytest.raises(SessionError, match="another entrain session"),
        folder.held(),
    ):
        pass
    with folder.held():
        pass


def test_a_block_can_be_repeated_while_it_runs_or_once_it_is_done(begin):
    folder = begin()
    with pytest.raises(SessionError, match="no block has started; allowed: none yet"):
        folder.repeat("why")
    folder.note("begun", 1, "block-01")
    with pytest.raises(SessionError, match="needs a reason"):
        folder.repeat("")
    assert folder.repeat("shoes untied") == 1
    folder.note("done", 1, "block-01")
    assert (folder.runs(), folder.next_block()) == ({}, 1)
    with pytest.raises(SessionError, match="block 1 is not done"):  # it is already the next block
        folder.repeat("again")
    folder.note("begun", 1, "block-01_run-2")
    folder.note("done", 1, "block-01_run-2")
    assert folder.next_block() == 2
    folder.note("begun", 2, "block-02")
    folder.note("failed", 2, "block-02", "it broke")
    with pytest.raises(SessionError, match="block 2 is not done; allowed: 1"):
        folder.repeat("it broke")


def test_a_session_reports_its_state(begin):
    folder = begin()
    states = []

    def note(*entry, **text):
        folder.note(*entry, **text)
        states.append((folder.standing(), folder.paused))

    note("begun", 1, "block-01")
    note("pause", 2, text="tired")
    note("done", 1, "block-01")
    note("go on", 2)
    note("rest", 2, text="600 s")
    note("begun", 2, "block-02")
    note("done", 2, "block-02")
    assert states == [
        ("block 1 of 2 (faster)", None),
        ("block 1 of 2 (faster), then a pause: tired", "tired"),
        ("paused before block 2 of 2 (slower): tired", "tired"),
        ("next: block 2 of 2 (slower)", None),
        ("rest before block 2 of 2 (slower): 600 s", None),
        ("block 2 of 2 (slower)", None),
        ("next: the end", None),
    ]


def test_a_clock_that_was_set_back_does_not_lengthen_a_rest(begin):
    folder = begin()
    with (folder.path / "ledger.tsv").open("a") as file:
        file.write("2126-11-26T10:00:00+00:00\trest\t1\t\t600 s\n")
    assert folder.standing() == "rest before block 1 of 2 (faster): 600 s"


def test_a_blinded_session_reports_block_numbers_only(begin):
    assert begin(BLIND).standing() == "next: block 1 of 2"


def test_a_sealed_session_reveals_no_name_before_it_is_unblinded(begin, tmp_path):
    folder = begin(BLIND)
    assert folder.names() == ["block 1", "block 2"]
    assert folder.plan["blocks"] is None
    assert "faster" not in (folder.path / "session.json").read_text()
    bag = folder.path / "bags/block-01"
    (bag.parent / "block-02").mkdir(parents=True)
    bag.mkdir()
    (tmp_path / "link").symlink_to(bag)
    ways = (bag, bag / "block-01_0.mcap", bag.parent / "block-02/../block-01", tmp_path / "link")
    assert all(is_sealed(way) for way in ways)
    assert (folder.path / "key.json").stat().st_mode & 0o222 == 0
    assert folder.unblind() == ["faster", "slower"]
    assert folder.names() == folder.unblind() == ["faster", "slower"]
    assert [entry.what for entry in folder.ledger] == ["unblinded"]


def test_no_two_keys_have_the_same_hash(begin, write, tmp_path):
    first = begin(BLIND).plan["key"]
    again = SessionFolder.begin(tmp_path / "again", read_session(write(BLIND)))
    assert again.plan["key"] != first


def test_a_key_that_is_not_the_sealed_one_is_refused(begin):
    folder = begin(BLIND)
    key = folder.path / "key.json"
    content = json.loads(key.read_text())
    content["blocks"].reverse()
    key.chmod(0o600)
    key.write_text(json.dumps(content))
    message = r"key.json: its SHA-256 starts with \w{12}, but .* has \w{12};"
    with pytest.raises(SessionError, match=message):
        folder.unblind()
    assert folder.sealed
    key.unlink()
    with pytest.raises(SessionError, match=r"key.json: cannot be read"):
        folder.unblind()


def test_a_bag_with_another_key_is_reported(done):
    folder = done(BLIND)  # its bags name no key
    with pytest.raises(SessionError, match=r"but .*block-01 has none;"):
        folder.unblind()


def test_a_session_that_is_not_blinded_has_no_seal(begin):
    with pytest.raises(SessionError, match="not blinded"):
        begin().unblind()


def test_a_folder_that_is_not_a_session_is_reported(tmp_path):
    with pytest.raises(SessionError, match=r"not a session: no readable session.json"):
        SessionFolder(tmp_path).next_block()
