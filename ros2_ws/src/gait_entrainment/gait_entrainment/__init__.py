# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Entrainment of walking to an ankle robot: the ROS-free core. README.md says where to start."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gait_entrainment.gait import analyze
    from gait_entrainment.parameters import WalkerParameters
    from gait_entrainment.protocol import Protocol, read_protocol
    from gait_entrainment.robot import find_driver
    from gait_entrainment.simulation import simulate

# The main entry points are loaded on first use, because a command needs only some of them.
_MODULES = {"analyze": "gait", "WalkerParameters": "parameters", "find_driver": "robot"}
_MODULES |= {"Protocol": "protocol", "read_protocol": "protocol", "simulate": "simulation"}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
