# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the processes of a run share: environment and installed files."""

import getpass
import os
import shutil
import socket
import tempfile
from contextlib import suppress
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from ament_index_python.resources import get_resources

from gait_entrainment.errors import EntrainmentError

PACKAGE = "gait_entrainment_nodes"
# Priorities of processes in a real-time run, below the loop that times the torque. The process
# whose messages are judged by their punctuality does not wait for another's turn.
PRIORITY, PUNCTUAL = 10, 11
SHARED_MEMORY = Path("/dev/shm")
# A range of ports for each domain of this many in a row, config/fastdds.xml says for what. The
# lowest range is above port 5353, which mDNS needs; foreign processes use the one at 7000.
_PORT_RANGES = 15
# Without a page for its locks there, Fast DDS dies of SIGBUS; it can do without the rest [bytes].
_LOCKS = 1_000_000


class UnusableEnvironmentError(EntrainmentError):
    """ROS cannot start in this environment; the message names the variable or the place."""


def require_usable_environment() -> None:
    """
    Check that ROS can start, before it is loaded: it would end the process with its own messages.

    Logs go to a temporary folder if there is no writable home folder, and the ports are chosen on
    which no process of another domain listens. Raises UnusableEnvironmentError.
    """
    chosen = os.environ.get("RMW_IMPLEMENTATION")
    installed = get_resources("rmw_typesupport").keys() - {"rmw_implementation"}
    if chosen and chosen not in installed:
        raise UnusableEnvironmentError(
            f"RMW_IMPLEMENTATION: {chosen!r} is not installed; allowed: "
            f"{', '.join(sorted(installed))}, or unset"
        )
    if os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "OFF":
        raise UnusableEnvironmentError(
            "ROS_AUTOMATIC_DISCOVERY_RANGE: 'OFF' keeps nodes from finding each other; allowed: "
            "LOCALHOST, SUBNET, SYSTEM_DEFAULT, or unset"
        )
    for peer in filter(None, os.environ.get("ROS_STATIC_PEERS", "").split(";")):
        try:
            socket.getaddrinfo(peer, None)
        except (OSError, UnicodeError):
            allowed = "allowed: names or addresses separated by ;"
            message = f"ROS_STATIC_PEERS: {peer!r} is not a known host; {allowed}"
            raise UnusableEnvironmentError(message) from None
    if SHARED_MEMORY.exists() and shutil.disk_usage(SHARED_MEMORY).free < _LOCKS:
        raise UnusableEnvironmentError(
            f"{SHARED_MEMORY} is full, and Fast DDS needs it; remove what fills it, such as "
            "fastrtps_* of processes that have ended"
        )
    _choose_log_folder()
    os.environ.update(_port_variables())


def _port_variables() -> dict[str, str]:
    """Return the environment variables that config/fastdds.xml reads for ROS_DOMAIN_ID."""
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    shift = 1 + (int(domain) if domain.isdigit() else 0) % _PORT_RANGES
    return {
        "GAIT_ENTRAINMENT_PORT_BASE": str(7400 - 100 * shift),
        "GAIT_ENTRAINMENT_PORT_SHIFT": str(shift),
    }


def _choose_log_folder() -> None:
    """Check that ROS can write its logs where the user wants; otherwise use a temporary folder."""
    given = os.environ.get("ROS_LOG_DIR", "")
    folder = given or f"{os.environ.get('ROS_HOME') or '~/.ros'}/log"
    try:
        if folder.startswith("~") and "HOME" not in os.environ:
            raise FileNotFoundError
        path = Path(folder).expanduser()
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
    except OSError as error:
        if given:
            raise UnusableEnvironmentError(
                f"ROS_LOG_DIR: {given}: cannot be written to: {error.strerror}; allowed: a "
                "writable folder, or unset"
            ) from None
        os.environ["ROS_LOG_DIR"] = f"{tempfile.gettempdir()}/ros-{os.getuid()}"


def shared_file(package: str, name: str) -> Path:
    """Return the path of a file that a package has installed in its share folder."""
    return Path(get_package_share_directory(package)) / name


def dds_variables(*, real_time: bool) -> dict[str, str]:
    """
    Return the environment variables that choose discovery and the Fast DDS profiles.

    They stay as the user has set them, but for the ports. The files say what the profiles are
    for; those for real time are for one host, so a process that looks for peers on others keeps
    the common ones.
    """
    reach, file = "ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTRTPS_DEFAULT_PROFILES_FILE"
    common, paced = (
        str(shared_file(PACKAGE, f"config/{name}.xml"))
        for name in ("fastdds", "fastdds_real_time")
    )
    chosen = {reach: os.environ.get(reach) or "LOCALHOST", file: os.environ.get(file) or common}
    given = Path(chosen[file])
    # Not set by the user, but by the parent process or the set-up of another workspace.
    if given.parts[-3:-1] == (PACKAGE, "config"):
        chosen[file] = common
        if given.name == Path(paced).name:
            chosen[reach] = "LOCALHOST"
    alone = chosen[reach] == "LOCALHOST" and not os.environ.get("ROS_STATIC_PEERS")
    if real_time and alone and chosen[file] == common:
        chosen = {reach: "SYSTEM_DEFAULT", file: paced}
    return chosen | _port_variables()


def set_environment(domain: int, *, real_time: bool = False) -> dict[str, str]:
    """
    Put this process into a ROS domain; return the environment for the processes it starts.

    Must be called before ROS is loaded. Raises UnusableEnvironmentError if ROS could not start.
    """
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    require_usable_environment()
    os.environ.update(dds_variables(real_time=real_time))
    # No node has large matrices: threads for them take longer to start than they save.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    return dict(os.environ)


def come_before_others(priority: int = PRIORITY) -> None:
    """
    Have all threads of this process scheduled before those of others, if the system permits.

    For a process that waits most of the time: one that computes continuously would use up what
    the system leaves to such processes, and hold up the loop that times the torque. Niceness is
    not enough: it counts only within a session.
    """
    for thread in Path("/proc/self/task").iterdir():
        with suppress(OSError):  # not permitted, so it takes its turn like others; or it has ended
            os.sched_setscheduler(int(thread.name), os.SCHED_RR, os.sched_param(priority))


def user_and_host() -> str:
    """Return the user and the host of this process."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = f"user {os.getuid()}"
    return f"{user}@{socket.gethostname()}"
