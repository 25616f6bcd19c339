# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Errors about bags. Each message is one readable line."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gait_entrainment.errors import EntrainmentError


class BagError(EntrainmentError):
    """A request that a bag does not allow."""


class BagExistsError(BagError):
    """The folder to create already exists; nothing was touched."""

    exit_code = 2


class UnreadableBagError(BagError):
    """Not a bag, or one that is damaged or was never closed."""


class NoBagError(UnreadableBagError):
    """There is nothing at the given path."""

    exit_code = 2


class NothingToPlayError(BagError):
    """A bag without a message on the topics to be played."""


class DefinitionMissingError(BagError):
    """No definition of a message type is installed, so no viewer could decode its messages."""


class BagWriteError(BagError):
    """The recording could not continue; what was written before is still there."""


class DiskFullError(BagWriteError):
    """The disk is full; the message states whether the bag could be closed."""


@contextmanager
def noting(note: Callable[[str], object]) -> Iterator[None]:
    """Pass an UnreadableBagError's text to a function instead of raising it."""
    try:
        yield
    except UnreadableBagError as error:
        note(str(error))


def make_folder(folder: Path) -> None:
    """Create a folder, or use an empty one; raises BagExistsError or BagWriteError."""
    if not is_utf8(folder):
        raise BagWriteError(f"{str(folder)!a}: cannot be created; allowed: UTF-8 names")
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        if folder.is_dir() and not any(folder.iterdir()):
            return
        raise BagExistsError(
            f"{folder}: already exists; choose another folder, nothing is overwritten"
        ) from None
    except OSError as error:
        raise BagWriteError(f"{folder}: cannot be created: {error.strerror}") from None


def is_utf8(path: Path) -> bool:
    """Return whether a path can be stored in a bag and passed as a ROS parameter."""
    return not any("\ud800" <= character <= "\udfff" for character in str(path.absolute()))
