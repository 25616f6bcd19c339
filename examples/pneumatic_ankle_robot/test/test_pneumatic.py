# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The complete test of an external driver: pytest --ankle-robot pneumatic."""


def test_the_driver_keeps_its_promises(ankle_robot_check):
    ankle_robot_check()
