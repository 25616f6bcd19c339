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

"""A ROS domain for each run, so that concurrent runs do not hear each other."""

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# Domains whose ports lie below those that Linux gives to other connections.
DOMAINS = range(1, 102)


class DomainError(RuntimeError):
    """No domain can be had; the message says what to do."""


@contextmanager
def claimed_domain() -> Iterator[int]:
    """
    Claim a ROS domain for the time of a run: ROS_DOMAIN_ID where it is set, else a free one.

    Claims are file locks: they end with the process, however it ends.

    Raises
    ------
    DomainError
        where ROS_DOMAIN_ID is not a domain, or is claimed by another run.

    """
    wanted = os.environ.get("ROS_DOMAIN_ID")
    if wanted is not None and not (wanted.isdigit() and int(wanted) <= 232):
        raise DomainError(f"ROS_DOMAIN_ID: {wanted!r}; allowed: 0 to 232, or unset for a free one")
    candidates = DOMAINS if wanted is None else [int(wanted)]
    for domain in candidates:
        file = _claim_file(domain)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(file)
            continue
        try:
            yield domain
        finally:
            os.close(file)
        return
    if wanted is None:
        raise DomainError(f"every ROS domain from {DOMAINS[0]} to {DOMAINS[-1]} is in use")
    raise DomainError(
        f"ROS_DOMAIN_ID: {wanted} is in use by another run; choose another or unset it"
    )


def _claim_file(domain: int) -> int:
    """
    Open the file whose lock is the claim on a domain.

    Another user's claims are honoured too: everyone may make such files, and reading suffices to
    lock one.
    """
    folder = Path(tempfile.gettempdir()) / "gait_entrainment_domains"
    try:
        folder.mkdir()
        folder.chmod(0o1777)
    except FileExistsError:
        pass
    try:
        return os.open(folder / str(domain), os.O_RDONLY)
    except FileNotFoundError:
        return os.open(folder / str(domain), os.O_RDONLY | os.O_CREAT, 0o644)
    except OSError as error:
        raise DomainError(f"{folder / str(domain)}: {error.strerror}; remove it") from None
