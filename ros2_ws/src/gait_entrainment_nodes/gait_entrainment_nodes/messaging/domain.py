# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A ROS domain for each run, so that concurrent runs do not hear each other."""

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager

from gait_entrainment.errors import EntrainmentError

# Domains whose ports lie below those that Linux assigns to other connections.
DOMAINS = range(1, 102)
# The largest domain for which DDS has ports.
LARGEST_DOMAIN = 232
# Prefix of the names of all claims.
CLAIMS = "gait_entrainment/domain"


class DomainError(EntrainmentError):
    """No domain is available; the message says what to do."""


def wanted_domain() -> int | None:
    """Return ROS_DOMAIN_ID, None if it is unset; DomainError if it is not a domain."""
    wanted = os.environ.get("ROS_DOMAIN_ID")
    if wanted is not None and not (wanted.isdigit() and int(wanted) <= LARGEST_DOMAIN):
        raise DomainError(
            f"ROS_DOMAIN_ID: {wanted!r}; allowed: 0 to {LARGEST_DOMAIN}, or unset for a free one"
        )
    return None if wanted is None else int(wanted)


@contextmanager
def claimed_domain() -> Iterator[int]:
    """
    Claim a ROS domain for the duration of a run: ROS_DOMAIN_ID if it is set, else a free one.

    A claim is the name of an abstract Unix socket. Such names belong to the network namespace,
    and so do the ports through which runs would hear each other: a claim holds across users and
    across containers that share a network, and ends with the process, however that ends.

    Raises DomainError if ROS_DOMAIN_ID is not a domain, or if it or all domains are claimed.
    """
    wanted = wanted_domain()
    for domain in DOMAINS if wanted is None else [wanted]:
        claim = _claim(domain)
        if claim is not None:
            with claim:
                yield domain
            return
    if wanted is None:
        raise DomainError(f"every ROS domain from {DOMAINS[0]} to {DOMAINS[-1]} is in use")
    raise DomainError(
        f"ROS_DOMAIN_ID: {wanted} is in use by another run; choose another or unset it"
    )


def domains_in_use() -> list[int]:
    """Return the domains that runs on this machine have claimed."""
    claimed = []
    for domain in range(LARGEST_DOMAIN + 1):
        claim = _claim(domain)
        if claim is None:
            claimed.append(domain)
        else:
            claim.close()
    return claimed


def _claim(domain: int) -> socket.socket | None:
    """Return the socket whose name is the claim on a domain, None if another process holds it."""
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(f"\0{CLAIMS}/{domain}")
    except OSError:
        claim.close()
        return None
    return claim
