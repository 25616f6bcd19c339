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

"""Claims on ROS domains: exclusive among all processes, and gone with their holder."""

import subprocess
import sys

import pytest

from gait_entrainment_nodes import domain as module
from gait_entrainment_nodes.domain import DOMAINS, DomainError, claimed_domain, domains_in_use


@pytest.fixture(autouse=True)
def own_claims(tmp_path, monkeypatch):
    """Keep claims apart from those of runs that go on beside the tests."""
    monkeypatch.setattr(module, "CLAIMS", f"gait_entrainment/test{tmp_path}")
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def test_claims_differ_and_end():
    with claimed_domain() as one, claimed_domain() as other:
        assert {one, other} == {DOMAINS[0], DOMAINS[1]}
    with claimed_domain() as again:
        assert again == one


def test_chosen_domain_is_claimed_once(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    with claimed_domain() as domain:
        assert domain == 42
        with pytest.raises(DomainError, match="ROS_DOMAIN_ID: 42 is in use"), claimed_domain():
            pass
    with claimed_domain():
        pass


@pytest.mark.parametrize("wanted", ["233", "-1", "", "nine", "1.5"])
def test_what_is_no_domain_is_refused(wanted, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", wanted)
    with pytest.raises(DomainError, match="allowed: 0 to 232"), claimed_domain():
        pass


def test_every_domain_taken_is_said(monkeypatch):
    monkeypatch.setattr(module, "DOMAINS", range(1, 3))
    taken = pytest.raises(DomainError, match="every ROS domain from 1 to 2 is in use")
    with claimed_domain(), claimed_domain(), taken, claimed_domain():
        pass


def test_claim_ends_with_a_killed_process():
    program = (
        "import time\n"
        "from gait_entrainment_nodes import domain as module\n"
        f"module.CLAIMS = {module.CLAIMS!r}\n"
        "with module.claimed_domain() as d: print(d, flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as holder:
        first = int(holder.stdout.readline())
        with claimed_domain() as other:
            assert other != first
        holder.kill()
    with claimed_domain() as free:
        assert free == first


def test_domains_in_use_are_those_that_are_claimed(monkeypatch):
    assert domains_in_use() == []
    monkeypatch.setenv("ROS_DOMAIN_ID", "200")
    with claimed_domain():
        monkeypatch.delenv("ROS_DOMAIN_ID")
        with claimed_domain() as other:
            assert domains_in_use() == [other, 200]
    assert domains_in_use() == []
