# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Errors that a user can cause; the message of each is one line."""


class EntrainmentError(Exception):
    """
    Something that cannot be done; the message says which field, what is allowed, what to do.

    The command line prints the message and ends with the exit code.
    """

    exit_code = 1


class UsageError(EntrainmentError, ValueError):
    """The command, an option or a file says something that cannot be meant."""

    exit_code = 2
