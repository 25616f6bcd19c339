# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Errors that a user can cause; the message of each is one line."""


class EntrainmentError(Exception):
    """
    Something cannot be done; the message says which field, what is allowed and what to do.

    The command line prints the message and exits with the exit code.
    """

    exit_code = 1


class UsageError(EntrainmentError, ValueError):
    """The command, an option or a file is invalid."""

    exit_code = 2
