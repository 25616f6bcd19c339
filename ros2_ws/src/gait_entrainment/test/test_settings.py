# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Settings: which values are accepted, and the messages about mistakes."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.settings import (
    Checked,
    Setting,
    SettingError,
    setting,
    settings_of,
)


@dataclass(frozen=True)
class Example(Checked):
    width: float = setting(0.1, "duration", "s", (0, 10), least_excluded=True)
    count: int = setting(5, "number of pulses", within=(1, 1_000_000))
    phase: float = setting(0.0, "place in the stride", "1", (0, 1), most_excluded=True)
    torque: float | None = setting(None, "height", "N m", kind=float, optional=True)
    side: Side = setting(Side.RIGHT, "leg")
    motor: str = setting("AK1", "type", choices=("AK1", "AK2"))
    name: str = setting("x", "name", plain=True)
    armed: bool = setting(False, "whether torque may come")
    other: tuple = ()


def test_settings_are_the_fields_that_can_be_set():
    found = settings_of(Example)
    assert list(found)[-1] == "armed"
    assert found["width"].meaning == "duration"
    assert found["count"].kind is int


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 0}, "width: 0.0; allowed: above 0 and at most 10 s"),
        ({"width": "1"}, "width: '1'; allowed: above 0 and at most 10 s"),
        ({"width": True}, "width: True; allowed: above 0 and at most 10 s"),
        ({"width": math.nan}, "width: nan; allowed: above 0 and at most 10 s"),
        ({"torque": 10**400}, "torque: inf; allowed: any finite number N m"),
        ({"count": 2.0}, "count: 2.0; allowed: a whole number from 1 to 1000000"),
        ({"count": True}, "count: True; allowed: a whole number from 1 to 1000000"),
        ({"phase": 1}, "phase: 1.0; allowed: at least 0 and below 1"),
        ({"side": "right"}, "side: 'right'; allowed: left, right"),
        ({"motor": "AK3"}, "motor: 'AK3'; allowed: AK1, AK2"),
        ({"name": "a/b"}, "name: 'a/b'; allowed: a plain name"),
        ({"name": " "}, "name: ' '; allowed: a plain name"),
        ({"name": ".x"}, "name: '.x'; allowed: a plain name"),
        ({"armed": 1}, "armed: 1; allowed: true, false"),
    ],
)
def test_a_mistake_is_reported_in_one_line(values, message):
    with pytest.raises(SettingError) as refused:
        Example(**values)
    assert str(refused.value) == message
    assert refused.value.exit_code == 2


def test_numbers_are_converted_to_the_type_of_the_setting():
    example = Example(width=1, torque=np.float64(2.5))
    assert (type(example.width), type(example.torque)) == (float, float)
    assert example.phase == 0.0


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("width", "1e-3", 0.001),
        ("count", "7", 7),
        ("side", "Left", Side.LEFT),
        ("armed", "true", True),
        ("name", "1", "1"),
    ],
)
def test_text_is_parsed(name, text, value):
    assert settings_of(Example)[name].parse(name, text) == value


@pytest.mark.parametrize(
    ("name", "text", "allowed"),
    [
        ("width", "soon", "above 0 and at most 10 s"),
        ("width", "nan", "above 0 and at most 10 s"),
        ("count", "7.0", "a whole number from 1 to 1000000"),
        ("side", "middle", "left, right"),
        ("armed", "1", "true, false"),
    ],
)
def test_text_that_is_not_an_allowed_value_is_refused(name, text, allowed):
    with pytest.raises(SettingError) as refused:
        settings_of(Example)[name].parse(name, text)
    assert str(refused.value) == f"{name}: {text!r}; allowed: {allowed}"


def test_a_setting_without_bounds_allows_every_finite_number():
    torque = Setting("torque", unit="N m")
    assert torque.check("torque", -1e9) == -1e9
    with pytest.raises(SettingError, match="any finite number N m"):
        torque.check("torque", math.inf)
