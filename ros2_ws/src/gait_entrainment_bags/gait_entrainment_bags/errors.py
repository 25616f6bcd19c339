# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What can go wrong with a bag. Each message is one line for people."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gait_entrainment.errors import EntrainmentError


class BagError(EntrainmentError):
    """Something about a bag prevents what was asked for."""


class BagExistsError(BagError):
    """The folder to make is already there; nothing was touched."""

    exit_code = 2


class UnreadableBagError(BagError):
    """Not a bag, or one that is damaged or was never closed."""


class NoBagError(UnreadableBagError):
    """There is nothing at the path that was given."""

    exit_code = 2


class NothingToPlayError(BagError):
    """A bag without a message on the topics that are to be played."""


class DefinitionMissingError(BagError):
    """No definition of a message type is installed, so no viewer could decode its messages."""


class BagWriteError(BagError):
    """The recording could not go on; what was written before is still there."""


class DiskFullError(BagWriteError):
    """The disk is full; the message says whether the bag could be closed."""


@contextmanager
def noting(note: Callable[[str], object]) -> Iterator[None]:
    """Note what turns out to be unreadable, and go on after it."""
    try:
        yield
    except UnreadableBagError as error:
        note(str(error))


def make_folder(folder: Path) -> None:
    """Make a folder, or take an empty one; raises BagExistsError or BagWriteError."""
    if not is_utf8(folder):
        raise BagWriteError(f"{str(folder)!a}: cannot be made; allowed: a name in UTF-8")
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        if folder.is_dir() and not any(folder.iterdir()):
            return
        raise BagExistsError(
            f"{folder}: is already there; choose another folder, nothing is overwritten"
        ) from None
    except OSError as error:
        raise BagWriteError(f"{folder}: cannot be made: {error.strerror}") from None


def is_utf8(path: Path) -> bool:
    """Whether a path can be written into a bag, and be the value of a ROS parameter."""
    return not any("\ud800" <= character <= "\udfff" for character in str(path.absolute()))
