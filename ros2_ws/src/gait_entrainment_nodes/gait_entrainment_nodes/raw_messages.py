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
Serialized messages made by patching numbers into a template.

Building a message in Python and serializing it costs five times as much as writing its bytes.
All messages of a sampled topic have the same layout; only their numbers differ. So one message
is serialized by ROS itself with marked numbers, the marks are found in its bytes, and from then
on a whole stretch of samples becomes one array of bytes.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND

# A mark is a double that no real number and no text of a template contains.
_MARK = 0x4D61726B00000000


def mark(number: int) -> float:
    """Return the double that marks field ``number`` (from 0) of a template."""
    return float(np.array(_MARK + number, np.uint64).view(np.float64))


class MessageTemplate:
    """
    The bytes of one message, ready to be filled with other numbers.

    Parameters
    ----------
    message
        A ROS message with a header, whose changing doubles hold marks: ``mark(i)`` in the first
        element of field i, the elements of one field being adjacent.
    fields
        Name and number of elements of each field, in the order of the marks.

    """

    def __init__(self, message: Any, fields: Mapping[str, int]) -> None:
        message.header.stamp.sec, message.header.stamp.nanosec = 0, 0
        self._bytes = np.frombuffer(serialize_message(message), np.uint8)
        content = self._bytes.tobytes()
        names, formats, offsets = ["sec", "nanosec"], ["<i4", "<u4"], [4, 8]
        for number, (name, length) in enumerate(fields.items()):
            pattern = (_MARK + number).to_bytes(8, "little")
            if content.count(pattern) != 1:
                raise ValueError(f"field {name} is not marked exactly once in the template")
            names.append(name)
            formats.append(f"({length},)<f8")
            offsets.append(content.index(pattern))
        self._layout = np.dtype(
            {"names": names, "formats": formats, "offsets": offsets, "itemsize": len(content)}
        )

    def fill(self, stamps: np.ndarray, **columns: np.ndarray) -> Iterator[bytes]:
        """
        Yield one serialized message per sample.

        Parameters
        ----------
        stamps
            Instants [ns since 1970], shape (n,), int64.
        columns
            Values of each field, shape (n, length of the field).

        """
        table = np.tile(self._bytes, (len(stamps), 1))
        rows = table.view(self._layout)[:, 0]
        rows["sec"], rows["nanosec"] = np.divmod(stamps, NANOSECONDS_PER_SECOND)
        for name, values in columns.items():
            rows[name] = values
        content, size = table.tobytes(), table.shape[1]
        for begin in range(0, len(content), size):
            yield content[begin : begin + size]
