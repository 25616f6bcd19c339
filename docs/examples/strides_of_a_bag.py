# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""List the strides of a recorded run: python strides_of_a_bag.py bags/paper_example."""

import sys

from gait_entrainment_bags import BagReader

with BagReader(sys.argv[1]) as bag:
    print(f"{bag.message_count} messages in {bag.duration / 1e9:.1f} s")
    for message, stride in bag.decoded(["/gait/strides"]):
        seconds = (message.log_time - bag.start) / 1e9
        print(f"stride {stride.number:3} ends at {seconds:7.3f} s, period {stride.period:.4f} s")
