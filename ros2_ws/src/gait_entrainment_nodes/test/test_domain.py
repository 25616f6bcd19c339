# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Claims on ROS domains: exclusive among all processes, and released when their holder ends."""

import os
import subprocess
import sys
from argparse import Namespace

import pytest

from gait_entrainment_nodes.commands import stop_ros as stop_command
from gait_entrainment_nodes.messaging import domain as module
from gait_entrainment_nodes.messaging.domain import DomainError, claimed_domain


@pytest.fixture(autouse=True)
def own_domains(monkeypatch):
    """Use domains that runs alongside the tests do not claim."""
    monkeypatch.setattr(module, "DOMAINS", range(210, 212))
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def test_claims_differ_and_end():
    with claimed_domain() as first, claimed_domain() as second:
        assert (first, second) == (210, 211)
    with claimed_domain() as again:
        assert again == 210


def test_claim_ends_when_its_holder_fails():
    with pytest.raises(RuntimeError), claimed_domain():
        raise RuntimeError
    with claimed_domain() as free:
        assert free == 210


def test_chosen_domain_is_claimed_once(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "212")
    with claimed_domain() as domain:
        assert domain == 212
        with pytest.raises(DomainError, match="ROS_DOMAIN_ID: 212 is in use"), claimed_domain():
            pass
    with claimed_domain():
        pass


@pytest.mark.parametrize("wanted", ["233", "-1", "", "nine", "1.5"])
def test_an_invalid_domain_is_refused(wanted, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", wanted)
    with pytest.raises(DomainError, match="allowed: 0 to 232"), claimed_domain():
        pass


def test_it_is_reported_if_every_domain_is_taken():
    taken = pytest.raises(DomainError, match="every ROS domain from 210 to 211 is in use")
    with claimed_domain(), claimed_domain(), taken, claimed_domain():
        pass


def test_claim_ends_with_a_killed_process(monkeypatch):
    program = (
        "from gait_entrainment_nodes.messaging.domain import claimed_domain\n"
        "import time\n"
        "with claimed_domain() as domain: print(domain, flush=True); time.sleep(60)\n"
    )
    monkeypatch.setenv("ROS_DOMAIN_ID", "213")
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, env=dict(os.environ)
    ) as holder:
        assert holder.stdout.readline() == b"213\n"
        with pytest.raises(DomainError, match="213 is in use"), claimed_domain():
            pass
        holder.kill()
    with claimed_domain() as free:
        assert free == 213


def test_stop_in_an_invalid_domain_stops_every_run(monkeypatch, capsys):
    monkeypatch.setenv("ROS_DOMAIN_ID", "500")
    monkeypatch.setattr(stop_command, "domains_in_use", lambda: [7])
    monkeypatch.setattr(stop_command, "stop_all", lambda domain, _: {f"robot {domain}": "zero"})
    assert stop_command.run(Namespace(json=False)) == 0
    out, err = capsys.readouterr()
    assert out == "robot 0: zero\nrobot 7: zero\n"
    assert "ROS_DOMAIN_ID: '500'" in err
