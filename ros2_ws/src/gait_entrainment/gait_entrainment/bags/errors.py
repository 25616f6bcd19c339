# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

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
