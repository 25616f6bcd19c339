# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""C3D files, written by ezc3d: which foot is on which plate, and events from markers."""

import math

import numpy as np
import pytest
from walks import OFFSET, STANCE, STRIDE, times

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import find_detector
from gait_entrainment_sensors.motion_capture import events_of_markers, events_on_plates, read_c3d
from gait_entrainment_sensors.recording import RecordingError

ezc3d = pytest.importorskip("ezc3d")
STRIKE, TOE_OFF = EventKind
FRAMES, RATE, PER_FRAME = 400, 100.0, 10
FORCE = find_detector("vertical_force")
# Contacts on plates of 0.6 m, one behind the other: plate, foot, strike [s], toe-off [s].
CONTACTS = [(0, Side.RIGHT, 1.0, 1.7), (1, Side.LEFT, 1.55, 2.25)]
LABELS = ["LHEE", "LTOE", "RHEE", "RTOE", "SACR"]
LABELS_IN_WORDS = ["Left_Heel", "Left Toe", "RightHeel", "Bob:right.toe", "Sacrum"]


def feet(side, time):
    """Return heel and toe [mm] of a foot that swings close to the ground to its plate and on."""
    own = [contact for contact in CONTACTS if contact[1] is side]
    plate, strike, toe_off = own[0][0], own[0][2], own[-1][3]
    swung = max(strike - 0.05 - time, 0.0) - max(time - toe_off - 0.05, 0.0)  # [s]
    x = 300.0 + 600.0 * plate - 2000.0 * swung
    y, height = (150.0 if side is Side.LEFT else 250.0), (60.0 if swung else 30.0)
    return [x - 100.0, y, height], [x + 100.0, y, height]


def write(
    path, *, sign=-1.0, wrong=False, units="mm", labels=LABELS, plates=2, points=None, border=False
):
    """
    Write a file of plates and of feet on them.

    ``wrong``: both feet are on the right foot's plate. ``border``: the right foot is 0.25 m ahead.
    """
    file = ezc3d.c3d()
    point, analog, plate = (file["parameters"][n] for n in ("POINT", "ANALOG", "FORCE_PLATFORM"))
    point["LABELS"]["value"], point["UNITS"]["value"] = labels, [units]
    point["RATE"]["value"], analog["RATE"]["value"] = [RATE], [RATE * PER_FRAME]
    data = np.ones((4, len(LABELS), FRAMES))
    for frame in range(FRAMES):
        left, right = (feet(side, frame / RATE) for side in Side)
        if wrong:
            left = [[x, 330.0 - y, z] for x, y, z in right]
        if border:
            right = [[x + 250.0, y, z] for x, y, z in right]
        data[:3, :, frame] = np.array([*left, *right, [0.0, 0.0, 900.0]]).T
    file["data"]["points"] = data if points is None else points
    file["data"]["analogs"] = np.zeros((1, 6 * plates, FRAMES * PER_FRAME))
    if not plates:
        file.write(str(path))
        return path
    names = [f"{n}{p}" for p in range(plates) for n in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")]
    analog["LABELS"]["value"] = names
    analog["UNITS"]["value"] = ["N", "N", "N", "Nmm", "Nmm", "Nmm"] * plates
    time = np.arange(FRAMES * PER_FRAME) / RATE / PER_FRAME
    for place, _, strike, toe_off in CONTACTS[:plates]:
        loaded = 800.0 * np.sin(np.pi * np.clip((time - strike) / (toe_off - strike), 0, 1))
        file["data"]["analogs"][0, 6 * place + 2] = sign * loaded
        if border:  # moves the centre of pressure to the border [N mm]
            file["data"]["analogs"][0, 6 * place + 4] = sign * loaded * (250.0 - 500.0 * place)
    corners = np.array([[0, 600, 600, 0], [0, 0, 400, 400], [0, 0, 0, 0]], float)
    plate["USED"]["value"] = np.array([plates])
    plate["TYPE"]["value"] = np.full(plates, 2)
    plate["CORNERS"]["value"] = np.stack(
        [corners + np.array([[600.0 * p], [0], [0]]) for p in range(plates)], axis=-1
    )
    plate["ORIGIN"]["value"] = np.zeros((3, plates))
    plate["CHANNEL"]["value"] = np.arange(1, 6 * plates + 1).reshape(plates, 6).T
    file.write(str(path))
    return path


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_contact_belongs_to_the_foot_that_stands_there(tmp_path, sign):
    found, troubles = events_on_plates(read_c3d(write(tmp_path / "a.c3d", sign=sign)), FORCE)
    assert troubles == ()
    for _, side, strike, toe_off in CONTACTS:
        own = [d for d in found if d.side is side]
        assert times(own, STRIKE) == [pytest.approx(strike, abs=0.012)]
        assert times(own, TOE_OFF) == [pytest.approx(toe_off, abs=0.012)]


def test_a_plate_without_a_contact_is_reported(tmp_path):
    found, troubles = events_on_plates(read_c3d(write(tmp_path / "a.c3d", sign=-1e-3)), FORCE)
    assert found == []
    assert troubles[0] == "plate 1: no contact: forces of -1 to 0 N"


def test_plates_without_samples_are_ignored(tmp_path):
    path = write(tmp_path / "a.c3d", labels=LABELS_IN_WORDS)
    assert len(read_c3d(path).plates) == 2
    file = ezc3d.c3d(str(path))
    file["data"]["analogs"] = np.zeros((1, 0, 0))
    file["parameters"]["ANALOG"]["LABELS"]["value"] = []
    file["parameters"]["ANALOG"]["RATE"]["value"] = [0.0]
    file.write(str(path))
    capture = read_c3d(path)
    assert (len(capture.plates), len(capture.markers)) == (0, 5)


def test_a_contact_of_both_feet_is_discarded_and_reported(tmp_path):
    found, troubles = events_on_plates(read_c3d(write(tmp_path / "a.c3d", wrong=True)), FORCE)
    assert found == []
    assert "plate 1: 1 contacts of both feet" in troubles[0]


def test_a_foot_on_two_plates_at_once_strikes_once(tmp_path, monkeypatch):
    """The right foot lands heel first across the border between the plates."""
    monkeypatch.setattr(
        f"{__name__}.CONTACTS",
        [(0, Side.RIGHT, 1.0, 1.5), (1, Side.RIGHT, 1.2, 1.7), (1, Side.LEFT, 9.0, 9.5)],
    )
    found, _ = events_on_plates(read_c3d(write(tmp_path / "a.c3d", border=True)), FORCE)
    assert [(d.kind, d.side) for d in found] == [(STRIKE, Side.RIGHT), (TOE_OFF, Side.RIGHT)]
    assert [d.time for d in found] == [
        pytest.approx(1.0, abs=0.012),
        pytest.approx(1.7, abs=0.012),
    ]


def test_without_markers_each_plate_needs_a_foot(tmp_path):
    path = write(tmp_path / "a.c3d", labels=["A", "B", "C", "D", "E"])
    with pytest.raises(RecordingError, match="lacks markers left_heel, left_toe, right_heel"):
        events_on_plates(read_c3d(path), FORCE)
    found, _ = events_on_plates(read_c3d(path), FORCE, [Side.RIGHT, Side.LEFT])
    assert [d.side for d in found] == [Side.RIGHT] * 2 + [Side.LEFT] * 2
    with pytest.raises(RecordingError, match="holds 2 plates; --plates names 1"):
        events_on_plates(read_c3d(path), FORCE, [Side.RIGHT])
    named = dict(zip(("left_heel", "left_toe", "right_heel", "right_toe"), "ABCD", strict=True))
    assert len(events_on_plates(read_c3d(path, named), FORCE)[0]) == 4


def test_a_plate_without_a_position_is_refused(tmp_path):
    path = write(tmp_path / "a.c3d")
    file = ezc3d.c3d(str(path))
    plate = file["parameters"]["FORCE_PLATFORM"]
    plate["CORNERS"]["value"] = plate["CORNERS"]["value"] * [1, 0]
    file.write(str(path))
    for sides in None, [Side.RIGHT, Side.LEFT]:
        with pytest.raises(RecordingError, match="CORNERS of plate 2 are one point: "):
            events_on_plates(read_c3d(path), FORCE, sides)


def test_an_invalid_file_a_missing_marker_and_an_unknown_unit_are_refused(tmp_path):
    path = tmp_path / "none.c3d"
    path.write_bytes(b"nothing")
    with pytest.raises(RecordingError, match="cannot be read as C3D"):
        read_c3d(path)
    with pytest.raises(RecordingError, match="has no marker X to use as left_heel"):
        read_c3d(write(tmp_path / "a.c3d"), {"left_heel": "X"})
    with pytest.raises(RecordingError, match="POINT:UNITS: 'feet'"):
        read_c3d(write(tmp_path / "b.c3d", units="feet"))


def test_heel_and_toe_relative_to_the_pelvis(tmp_path):
    """Markers swing as cosines: heels furthest ahead at strikes, toes furthest back at toe-off."""
    points = np.ones((4, len(LABELS), FRAMES))
    time = np.arange(FRAMES) / RATE
    for place, (side, late) in enumerate(
        [(s, late) for s in Side for late in (0.0, STANCE - STRIDE / 2)]
    ):
        swing = np.cos(2 * math.pi * (time - OFFSET[side] - late) / STRIDE)
        points[0, place] = 1300.0 * time + 300.0 * swing + (200.0 if late else 0.0)
        points[1:3, place] = 100.0
    points[0, 4], points[1:3, 4] = 1300.0 * time, 900.0
    points[:3, 0, 100:105] = np.nan  # hidden
    path = write(tmp_path / "a.c3d", plates=0, points=points)
    found = events_of_markers(read_c3d(path))
    for side in Side:
        own = [d for d in found if d.side is side]
        for kind, late in ((STRIKE, 0.0), (TOE_OFF, STANCE)):
            assert len(times(own, kind)) >= 2
            for found_at in times(own, kind):
                off = (found_at - OFFSET[side] - late + STRIDE / 2) % STRIDE - STRIDE / 2
                assert abs(off) < 0.011
