# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What can go wrong with a bag. Each message is one line for people.

    BagError
      BagExistsError           the folder to record into is already there
      UnreadableBagError       not a bag, or a damaged or unfinished one
      DefinitionMissingError   no definition of a message type is installed
      BagWriteError            the recording could not go on
        DiskFullError          ... because the disk is full
"""


class BagError(Exception):
    """Anything about a bag that stops what was asked for."""


class BagExistsError(BagError):
    """The folder to record into is already there; nothing was touched."""


class UnreadableBagError(BagError):
    """Not a bag, or one that is damaged, or that was never closed."""


class DefinitionMissingError(BagError):
    """No message definition for a type is installed, so no viewer could decode its messages."""


class BagWriteError(BagError):
    """The recording could not go on; what had been written before is still there."""


class DiskFullError(BagWriteError):
    """The disk is full; the message says whether the bag could be closed."""
