# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0
"""The services of docker/compose.yaml without containers: their commands run as processes."""

import os
import re
import shlex
import subprocess
from contextlib import ExitStack
from pathlib import Path

import yaml
from harness import TIMEOUT

from gait_entrainment_bags import BagReader
from gait_entrainment_bringup.node_list import NODES
from gait_entrainment_nodes.messaging.domain import claimed_domain

ROOT = Path(__file__).resolve().parents[2]
INSIDE = "/home/walker/gait_entrainment"
ENTRYPOINT = str(ROOT / "docker" / "entrypoint.bash")


def services(**variables):
    """Return the services, with variables substituted as Docker Compose does."""

    def value(match):
        return variables.get(match[1], match[2])

    text = (ROOT / "docker" / "compose.yaml").read_text()
    return yaml.safe_load(re.sub(r"\$\{(\w+):-(.*?)\}", value, text))["services"]


def assert_states_are_not_counted(bag):
    """
    Check the final counts of /diagnostics against what happened in the run.

    The state of a node that starts before the recorder reaches no reader, which is not a loss.
    """
    with BagReader(bag) as reader:
        decoded = [m for _, m in reader.decoded(["/diagnostics", "/published_counts"])]
    names = [s.name for m in decoded if hasattr(m, "status") for s in m.status]
    finals = [m for m in decoded if hasattr(m, "counts")]
    assert finals
    for message in finals:
        counted = message.counts[message.topics.index("/diagnostics")]
        assert counted <= names.count(f"{message.node.strip('/')}: run"), message.node


def test_services_conduct_and_record_one_experiment(tmp_path):
    defined = services(OPTIONS="--baseline=3 --pulses=5 --washout=1 --sample-rate=50")
    assert set(NODES) < set(defined)
    (tmp_path / "bags").mkdir()
    with claimed_domain() as domain, ExitStack() as stack:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}

        def run(words):
            # It inherits nothing that the image does not have as well.
            process = subprocess.Popen(
                words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
            )
            stack.callback(process.wait, TIMEOUT)
            stack.callback(process.terminate)
            return process

        def start(service):
            return run([ENTRYPOINT, *shlex.split(defined[service]["command"])])

        def healthy(name):
            kind, program, *words = defined[name]["healthcheck"]["test"]
            assert (kind, words) == ("CMD", ["entrain", "ready", name])
            check = [program.replace(INSIDE, str(ROOT)), *words, "--timeout=30"]
            return run(check).wait(TIMEOUT) == 0

        awaited = defined["experiment"]["depends_on"]
        assert set(awaited) == set(NODES) - {"experiment"}
        running = {name: start(name) for name in awaited}
        assert healthy("perturbator")  # the others' commands differ only in the name
        running["experiment"] = start("experiment")
        for name in defined["outcome"]["depends_on"]:
            assert running[name].wait(TIMEOUT) == 0, name
        text, _ = start("outcome").communicate(timeout=TIMEOUT)
        assert "strides          9, pulses placed in them: 5" in text
        assert_states_are_not_counted(tmp_path / "bags/from_compose")
        for name in set(NODES) - {"bag_recorder", "experiment"}:
            running[name].terminate()
            assert running[name].wait(TIMEOUT) == 0, name


def test_every_service_drops_its_privileges_and_has_no_network():
    for name, service in services().items():
        assert service["cap_drop"] == ["ALL"], name
        assert service["security_opt"] == ["no-new-privileges:true"], name
        shares_loopback = service["network_mode"] == "service:walker_sim"
        assert shares_loopback or service["network_mode"] == "none", name
        assert shares_loopback == (service.get("ipc") == "service:walker_sim"), name
