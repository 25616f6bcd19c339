# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

r"""
Ankle robot drivers by name, loaded only when chosen.

A driver is written as NAME or NAME:OPTION=VALUE,OPTION=VALUE, with the same syntax everywhere: in
a protocol, on the command line, as a parameter of the perturbator. A value may contain anything;
write ``\,`` for a comma, and ``\\`` for a backslash before a comma or another backslash.
An option of the robot on one ankle is written left.OPTION=VALUE or right.OPTION=VALUE.
Other packages register drivers under the entry point ``gait_entrainment.drivers``.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.errors import EntrainmentError
from gait_entrainment.robot.contract import AnkleRobot
from gait_entrainment.robot.faults import DeviceError, LimitError
from gait_entrainment.robot.guard import GuardedRobot
from gait_entrainment.robot.limits import DeviceLimits, Dose
from gait_entrainment.settings import SettingError, settings_of

ENTRY_POINTS = "gait_entrainment.drivers"
# The simulated drivers are listed here, so that a simulation need not search all packages.
OWN_DRIVERS = {
    "ideal": "gait_entrainment.robot.ideal:IdealAnkleRobot",
    "emulated": "gait_entrainment_drivers.emulated:EmulatedAnkleRobot",
}


@dataclass(frozen=True)
class Driver:
    """A chosen and loaded driver with its options, not yet connected."""

    name: str
    robot: type[AnkleRobot]
    options: Any

    def make(
        self,
        side: Side,
        limits: DeviceLimits | None = None,
        seed: int = 0,
        dose: Dose | None = None,
    ) -> GuardedRobot:
        """Return the robot behind the safety envelope, in the state before ``configure``."""
        return GuardedRobot(self.robot(side, self.options, seed), side, limits, dose)

    @property
    def simulated(self) -> bool:
        """Whether it runs in simulated time, and so can run in lock-step."""
        return self.robot(Side.LEFT, self.options, 0).capabilities.simulated


def driver_names() -> dict[str, str]:
    """Return the location of each driver by name; nothing is loaded."""
    others = {point.name: point.value for point in entry_points(group=ENTRY_POINTS)}
    return dict(sorted({**others, **OWN_DRIVERS}.items()))


def make_robots(
    text: str, sides: Sequence[Side], limits: DeviceLimits, seed: int = 0, dose: Dose | None = None
) -> dict[Side, GuardedRobot]:
    """
    Return a robot for each ankle, as ``Driver.make`` does; what stops one stops both.

    Raises as ``find_driver`` does, and LimitError if two ankles would share one real robot.
    """
    dose = dose or Dose()
    drivers = {side: find_driver(text, side) for side in sides}
    if len({driver_on(text, side) for side in sides}) < len(sides) and not all(
        driver.simulated for driver in drivers.values()
    ):
        raise LimitError(
            f"driver: {text} is one robot, and the protocol perturbs both legs; allowed: options "
            "for each robot, such as left.NAME=VALUE,right.NAME=VALUE, or blocks on one leg"
        )
    robots = {s: d.make(s, limits, seed + n, dose) for n, (s, d) in enumerate(drivers.items())}
    for side, robot in robots.items():
        robot.partner = robots.get(side.other)
    return robots


def driver_on(text: str, side: Side) -> str:
    """Return the driver text for one ankle, without the other ankle's options."""
    name, colon, options = text.partition(":")
    own, other = (f"{leg.name.lower()}." for leg in (side, side.other))
    parts = (part for part in split_options(options) if not part.startswith(other))
    return name + colon + join_options(part.removeprefix(own) for part in parts)


def find_driver(text: str, side: Side = Side.RIGHT) -> Driver:
    """
    Load the driver named by a text, for one ankle; the other ankle's options are also checked.

    Raises LimitError if the driver is unknown, or an option is unknown or out of range;
    DeviceError if the driver cannot be loaded.
    """
    name = text.partition(":")[0]
    target = OWN_DRIVERS.get(name) or driver_names().get(name)
    if target is None:
        known = ", ".join(driver_names())
        raise LimitError(f"driver: {name!r} is unknown; allowed: {known}")
    whose = f"driver: {name} ({target})"
    try:
        robot = EntryPoint(name, target, ENTRY_POINTS).load()
        if not (isinstance(robot, type) and issubclass(robot, AnkleRobot)):
            raise LimitError(f"{whose} is not an AnkleRobot: derive it from that class")
        texts = (driver_on(text, leg).partition(":")[2] for leg in Side)
        options = [read_options(f"driver: {name}", robot.Options, words) for words in texts]
        driver = Driver(name, robot, options[side])
        _ = driver.simulated  # a robot that cannot be made fails here
    except EntrainmentError:
        raise
    except (Exception, SystemExit) as error:  # the package may be third-party
        raise DeviceError(f"{whose} cannot be loaded: {error!r}; install what it needs") from error
    return driver


def split_options(text: str) -> list[str]:
    """Return the parts of OPTION=VALUE,OPTION=VALUE, without escapes."""
    parts = re.findall(r"(?:\\[\\,]|[^,])+", text)
    return [re.sub(r"\\([\\,])", r"\1", part) for part in parts]


def join_options(parts: Iterable[str]) -> str:
    """Return the text that split_options splits into these parts."""
    return ",".join(re.sub(r"([\\,])", r"\\\1", part) for part in parts)


def read_options(whose: str, options_type: type[Any], text: str) -> Any:
    """Return options from OPTION=VALUE,OPTION=VALUE; LimitError begins with ``whose``."""
    known = settings_of(options_type)
    values = {}
    for part in split_options(text):
        key, equals, value = part.partition("=")
        if not equals or key not in known:
            allowed = ", ".join(known) or "none"
            raise LimitError(f"{whose}: option {part!r}; allowed: {allowed}, as NAME=VALUE")
        if key in values:
            raise LimitError(f"{whose}: {key}: appears twice; keep one")
        try:
            values[key] = known[key].parse(f"{whose}: {key}", value)
        except SettingError as error:
            raise LimitError(str(error)) from None
    return options_type(**values)
