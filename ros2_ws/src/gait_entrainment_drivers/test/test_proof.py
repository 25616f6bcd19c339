# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Proofs: valid only for exactly the same options; an unreadable file proves nothing."""

import json
import socket
from importlib.metadata import version
from pathlib import Path

import pytest

from gait_entrainment.robot import DeviceError
from gait_entrainment_drivers.proof import keep_proof, proof_of, require_proof

KEY = f"{socket.gethostname()}/x:"  # for the driver x
ROBOT = r"ak_mit_can:channel=can0,note=a\,b"


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path / "gait_entrainment" / "proofs.json"


def test_a_proof_is_kept_and_can_be_withdrawn(state):
    assert proof_of(ROBOT) is None
    keep_proof(ROBOT, 0.05)
    keep_proof("other", 0.1)
    assert proof_of(ROBOT).within == 0.05
    assert proof_of(ROBOT).version == version("gait_entrainment")
    keep_proof(ROBOT, None)
    assert proof_of(ROBOT) is None
    assert proof_of("other").within == 0.1
    assert [file.name for file in state.parent.iterdir()] == ["proofs.json"]


@pytest.mark.usefixtures("state")
def test_a_proof_is_valid_only_for_the_same_options():
    keep_proof(ROBOT, 0.05)
    assert proof_of(r"ak_mit_can:note=a\,b,channel=can0")
    for other in ("ak_mit_can", "ak_mit_can:channel=can1", r"odrive_can:channel=can0,note=a\,b"):
        assert proof_of(other) is None


def test_a_proof_from_another_computer_with_the_same_home_is_not_valid(state, monkeypatch):
    keep_proof(ROBOT, 0.05)
    monkeypatch.setattr("socket.gethostname", lambda: "another")
    assert state.exists()
    assert proof_of(ROBOT) is None


TYPES = '{"KEY": {"within": "1", "at": 2, "version": "VERSION"}}'


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "3", '{"KEY": 3}', '{"KEY": {"within": 1}}', TYPES, "\0"]
)
def test_an_unreadable_file_proves_nothing_and_is_replaced(state, text):
    state.parent.mkdir()
    state.write_text(text.replace("KEY", KEY).replace("VERSION", version("gait_entrainment")))
    assert proof_of("x") is None
    keep_proof("x", 0.05)
    assert proof_of("x").within == 0.05


def test_a_proof_by_another_version_must_be_repeated(state):
    keep_proof("x", 0.05)
    state.write_text(state.read_text().replace(version("gait_entrainment"), "0.0.1"))
    with pytest.raises(DeviceError, match="not proved on this computer by this version"):
        require_proof("x", unproved=False)


def test_a_file_that_is_not_text_proves_nothing(state):
    state.parent.mkdir()
    state.write_bytes(b"\xff\xfe")
    assert proof_of("x") is None


def test_without_a_home_nothing_is_proved_and_keeping_a_proof_fails(monkeypatch):
    def no_home():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setenv("XDG_STATE_HOME", "relative/is/ignored")
    monkeypatch.setattr(Path, "home", no_home)
    assert proof_of("x") is None
    with pytest.raises(DeviceError, match=r"cannot be stored: .*home directory.*XDG_STATE_HOME"):
        keep_proof("x", 0.05)


def test_without_a_state_folder_proofs_are_kept_in_the_home(tmp_path, monkeypatch):
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    keep_proof("x", 0.05)
    file = tmp_path / ".local/state/gait_entrainment/proofs.json"
    assert json.loads(file.read_text())[KEY]["within"] == 0.05
