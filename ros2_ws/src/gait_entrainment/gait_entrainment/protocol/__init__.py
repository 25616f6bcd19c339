# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What an experiment should do: the validated protocol file."""

from gait_entrainment.protocol.block import Block, ProtocolError, PulsePlan
from gait_entrainment.protocol.protocol import FIELDS, Protocol, changes, content_of
from gait_entrainment.protocol.reader import DEFAULT_PROTOCOL, read_protocol, write_protocol
