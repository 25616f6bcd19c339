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

"""The nodes of an experiment: one list for ``entrain run`` and the launch files."""

from typing import Any

from gait_entrainment.device import find_driver
from gait_entrainment.protocol import Protocol

# In the order in which they are started. Executable and node have the same name.
NODES = ("bag_recorder", "walker_sim", "perturbator", "gait_analyzer", "experiment")
# In the order in which they are stopped: torque first, the record last.
STOP_ORDER = ("perturbator", "experiment", "walker_sim", "gait_analyzer", "bag_recorder")
# Nodes that publish what is counted at the end of a run.
PUBLISHERS = ("walker_sim", "perturbator", "gait_analyzer", "experiment")
# In real time promises are short, so that more can be decided late, but longer than a hiccup.
REAL_TIME_LOOKAHEAD = 0.3
# A real robot's torque is known only once it has been measured and promised: so much later than
# the wall clock [s] the walker shows what it felt.
MEASURED_DELAY = 0.1


def parameters(
    protocol: Protocol,
    bag: str,
    custom_data: str,
    *,
    real_time: bool,
    sampling: dict[str, Any],
    armed: bool = False,
    record_required: bool = False,
) -> dict[str, dict[str, Any]]:
    """
    Return the parameters of every node for one run, by node name.

    Parameters
    ----------
    protocol
        What to conduct.
    bag
        Folder of the bag to record.
    custom_data
        JSON object that the bag keeps.
    real_time
        Real time instead of lock-step.
    sampling
        Parameters of walker_sim that say what it samples and how often.
    armed
        Whether a real robot may deliver torque without another word.
    record_required
        Whether the run ends where nothing more can be recorded.

    """
    side = protocol.side.name.lower()
    walker = {name: getattr(protocol.walker, name) for name in protocol.walker.__match_args__}
    experiment: dict[str, Any] = {"participants": [node for node in NODES if node != "experiment"]}
    if real_time:
        experiment["longest_lookahead"] = REAL_TIME_LOOKAHEAD
    measured = real_time and not find_driver(protocol.driver).simulated
    return {
        "walker_sim": {
            **walker,
            **sampling,
            "first_heel_strike": side,
            "real_time": real_time,
            "acknowledged": not real_time,
            "presentation_delay": MEASURED_DELAY if measured else 0.0,
        },
        "perturbator": {
            "side": side,
            "driver": protocol.driver,
            "seed": protocol.seed,
            "armed": armed,
        },
        "gait_analyzer": {"side": side},
        "experiment": experiment,
        "bag_recorder": {
            "output": bag,
            "required": record_required,
            "publishers": list(PUBLISHERS),
            "custom_data": custom_data,
        },
    }
