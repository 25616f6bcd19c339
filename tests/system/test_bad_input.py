# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Mistakes on the command line and in parameters give one clear line and leave nothing behind."""

import os
import resource
import shutil
import subprocess
from pathlib import Path

import pytest
from harness import LONG, QUICK, TIMEOUT, entrain_run, probe

from gait_entrainment_bags import BagReader
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.domain import claimed_domain

BAG = Path(__file__).parents[2] / "bags" / "paper_example"
# What is wrong, the options, and what the line must name: field and allowed range.
WRONG_USAGE = {
    "negative width": (["--width=-0.1"], ["width", "-0.1", "1e-09 to 10 s"]),
    "overlapping pulses": (["--width=0.4", "--period=0.3"], ["width", "0.3", "intervals above"]),
    "weak spring": (["--ankle-stiffness=60"], ["ankle_stiffness", "60", "allowed:"]),
    "NaN": (["--mass=nan"], ["mass", "nan", "above 0"]),
    "infinite": (["--period-offset=inf"], ["period_offset", "inf", "-100"]),
    "no baseline": (["--baseline=1"], ["baseline", "1", "at least 2"]),
    "sample rate": (["--sample-rate=1001"], ["--sample-rate", "1001", "0 to 1000"]),
    "sample rate NaN": (["--sample-rate=nan"], ["--sample-rate", "nan", "0 to 1000"]),
    "lead time": (["--lead-time=20"], ["--lead-time", "20", "0.05 to 10 s"]),
    "another host, no domain": (["--elsewhere=walker_sim"], ["--elsewhere", "ROS_DOMAIN_ID"]),
    "unreadable file": (["nowhere.yaml"], ["nowhere.yaml", "cannot be read"]),
    "a folder as file": (["."], [".", "cannot be read"]),
}


def entrain(folder, *options, **environment):
    """Run a command to its end; return exit code and standard error."""
    done = subprocess.run(
        ["entrain", "run", *options],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert done.stdout == ""
    return done.returncode, done.stderr


def assert_one_line(text, named):
    assert len(text.splitlines()) == 1, text
    assert "Traceback" not in text
    for word in named:
        assert word in text, text


@pytest.mark.parametrize("case", WRONG_USAGE)
def test_wrong_usage_gives_one_line_and_leaves_nothing_behind(case, tmp_path):
    options, named = WRONG_USAGE[case]
    code, text = entrain(tmp_path, *options)
    assert code == 2
    assert_one_line(text, named)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--torque=31"], ["torque", "31", "-30 to 30 N m"]),
        (["--driver=magic"], ["driver", "magic", "ideal"]),
        (["--driver=emulated:delay=2"], ["delay: '2'", "0 to 0.5 s"]),
        (["--driver=ak_mit_can:motor=AK1"], ["motor: 'AK1'", "AK80-9"]),
        (["--driver=ak_mit_can"], ["runs in real time only", "add --real-time"]),
        (["--driver=ak_mit_can", "--real-time"], ["applies real torque", "--arm"]),
        (
            ["--driver=ak_mit_can", "--real-time", "--arm"],
            ["watchdog was not proved on this computer", "entrain driver prove 'ak_mit_can'"],
        ),
    ],
)
def test_refused_robot_options_give_one_line_and_leave_nothing_behind(options, named, tmp_path):
    code, text = entrain(tmp_path, *options)
    assert code == 1
    assert_one_line(text, named)
    assert list(tmp_path.iterdir()) == []


def test_unknown_key_is_reported_with_its_line(tmp_path):
    protocol = tmp_path / "mine.yaml"
    protocol.write_text("baseline: 5\npulses:\n  widht: 0.1\n")
    code, text = entrain(tmp_path, "mine.yaml")
    assert code == 2
    assert_one_line(text, ["mine.yaml:3", "widht", "width"])
    assert list(tmp_path.iterdir()) == [protocol]


def test_existing_output_is_not_touched(tmp_path):
    out = tmp_path / "there"
    out.mkdir()
    (out / "thesis.tex").write_text("years of work")
    code, text = entrain(tmp_path, "--out=there")
    assert code == 2
    assert_one_line(text, ["--out", "there", "never overwritten"])
    assert [path.name for path in out.iterdir()] == ["thesis.tex"]


def test_output_that_cannot_be_written_is_refused_before_anything_starts(tmp_path):
    (tmp_path / "file").write_text("")
    code, text = entrain(tmp_path, "--out=file/bag")
    assert code == 2
    assert_one_line(text, ["--out", "file", "not a folder"])
    code, text = entrain(tmp_path, "--out=/proc/bag")
    assert code == 2
    assert_one_line(text, ["--out", "/proc", "cannot be written to"])
    code, text = entrain(tmp_path, b"--out=\xff")  # it could not be a node parameter
    assert code == 2
    assert_one_line(text, ["--out", "udcff", "UTF-8"])


def test_domain_in_use_is_refused(tmp_path):
    with claimed_domain() as domain:
        code, text = entrain(tmp_path, ROS_DOMAIN_ID=str(domain))
    assert code == 1
    assert_one_line(text, [f"ROS_DOMAIN_ID: {domain} is in use", "another"])
    code, text = entrain(tmp_path, ROS_DOMAIN_ID="233")
    assert code == 1
    assert_one_line(text, ["ROS_DOMAIN_ID", "233", "0 to 232"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "domain", "code", "named"),
    [
        (["ready", "walker_sim"], "nine", 1, ["ROS_DOMAIN_ID", "'nine'", "0 to 232"]),
        (["node", "experiment"], "233", 1, ["ROS_DOMAIN_ID", "'233'", "0 to 232"]),
        (["ready", "no name"], "7", 2, ["no name", "alphanumerics"]),
    ],
)
def test_node_and_ready_refuse_an_invalid_domain_or_name(words, domain, code, named):
    done = subprocess.run(
        ["entrain", *words],
        capture_output=True,
        text=True,
        env={**os.environ, "ROS_DOMAIN_ID": domain},
    )
    assert done.returncode == code
    assert_one_line(done.stderr, named)


@pytest.mark.parametrize(
    "command",
    [
        ["entrain", "run"],
        ["entrain", "replay", str(BAG)],
        ["entrain", "node", "walker_sim"],
        ["entrain", "ready", "walker_sim"],
        ["entrain", "stop-ros"],
        ["entrain", "driver", "check", "--node", "perturbator"],
        ["walker_sim"],
    ],
    ids=" ".join,
)
def test_environment_in_which_ros_cannot_start_gives_one_line(command, tmp_path):
    done = subprocess.run(
        command,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        env={**os.environ, "RMW_IMPLEMENTATION": "rmw_nonsense"},
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert_one_line(done.stderr, [*command[:2], "RMW_IMPLEMENTATION: 'rmw_nonsense'", "allowed:"])
    assert list(tmp_path.iterdir()) == []


def test_run_needs_neither_home_nor_standard_output(tmp_path):
    environment = {name: value for name, value in os.environ.items() if name != "HOME"}
    words = ["--baseline=2", "--pulses=1", "--washout=0", "--no-figures", "--out=bag"]
    done = subprocess.run(
        ["sh", "-c", 'entrain run "$@" >&-', "sh", *words],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert_readable(tmp_path / "bag")


@pytest.fixture
def small_disk(tmp_path):
    """Yield a folder on a 6 MB file system; skip if none can be mounted."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=6m", "tmpfs", str(place)]
    if not shutil.which("mount") or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("file systems cannot be mounted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def assert_readable(bag):
    with BagReader(bag) as reader:
        assert sum(1 for _ in reader.messages()) == reader.message_count > 0


def test_full_disk_ends_the_run_if_the_record_is_required(small_disk):
    with entrain_run(small_disk / "bag", *LONG, "--sample-rate=1000", "--require-record") as run:
        run.find_nodes()
        assert run.wait() == 1
        assert "disk full" in run.text
        assert "Traceback" not in run.text
        assert_readable(run.bag)
        assert run.survivors() == []


@pytest.mark.parametrize("mode", [(), ("--real-time",)], ids=["lock-step", "real time"])
def test_full_disk_fails_the_run_only_after_the_walk(mode, small_disk):
    # The recorder reserves 3 MB, which leaves little for a walk of a few seconds.
    (small_disk / "filler").write_bytes(bytes(2_700_000))
    options = (*QUICK, "--baseline=2", "--pulses=14", "--washout=1", "--sample-rate=1000")
    with entrain_run(small_disk / "bag", *mode, *options) as run:
        assert run.wait() == 1
        # Reported only once the experiment has conducted the whole protocol.
        assert "bag_recorder did not complete the record" in run.text.splitlines()[0]
        assert "disk full" in run.text
        assert "Traceback" not in run.text
        assert_readable(run.bag)


def test_file_size_limit_ends_the_run_with_a_readable_bag(tmp_path):
    with entrain_run(tmp_path / "bag", *LONG, "--sample-rate=1000", "--require-record") as run:
        run.wait_for_stride(1)
        limits = (2 * 2**20, resource.RLIM_INFINITY)
        resource.prlimit(run.nodes["bag_recorder"], resource.RLIMIT_FSIZE, limits)
        assert run.wait() == 1
        assert "File too large" in run.text
        assert "Traceback" not in run.text
        assert_readable(run.bag)
        assert run.survivors() == []


def test_fall_is_reported_with_its_bag(tmp_path):
    # Dorsiflexion pulses take away the push-off that the walker needs to vault over.
    with entrain_run(tmp_path / "bag", "--torque=-29", "--width=0.4", "--json") as run:
        assert run.wait() == 1
        first = run.text.splitlines()[0]
        for word in ("fell", "stance", "rad", "J", str(run.bag)):
            assert word in first, run.text
        assert "Traceback" not in run.text
        assert_readable(run.bag)


# Node, arguments, and what the line must name.
WRONG_PARAMETERS = [
    ("walker_sim", ["-p", "mass:=-1.0"], ["mass", "-1.0", "above 0 and at most 10000 kg"]),
    ("walker_sim", ["-p", "mass:=-80"], ["mass", "-80", "above 0 and at most 10000 kg"]),
    # An integer is accepted for a float, so it is the other parameter that is refused.
    ("walker_sim", ["-p", "mass:=80", "-p", "sample_rate:=2000"], ["sample_rate", "2000"]),
    ("walker_sim", ["-p", "mass:=heavy"], ["mass", "heavy", "above 0 and at most 10000 kg"]),
    ("walker_sim", ["-p", "mass:=0.0"], ["mass", "0.0", "above 0"]),
    ("walker_sim", ["-p", "mass:=.nan"], ["mass", "nan"]),
    ("walker_sim", ["-p", "sample_rate:=1001.0"], ["sample_rate", "1001.0", "0 to 1000 Hz"]),
    ("walker_sim", ["-p", "first_heel_strike:=middle"], ["first_heel_strike", "left, right"]),
    ("perturbator", ["-p", "side:=up"], ["side", "'up'", "left, right"]),
    ("perturbator", ["-p", "limits.torque:=1000.0"], ["limits.torque", "1000.0", "0 to 200"]),
    # In the node's own section an unknown name is a typo, not another node's parameter.
    ("perturbator", ["-p", "limits.torqe:=5.0"], ["limits.torqe", "unknown", "limits.torque"]),
    ("gait_analyzer", ["-p", "side:=3"], ["side", "3"]),
    ("gait_analyzer", ["-p", "onset:=felt"], ["onset", "'felt'", "commanded, measured"]),
    ("experiment", ["-p", "silence_timeout:=0.0"], ["silence_timeout", "0.1 to 60 s"]),
    ("bag_recorder", [], ["output", "folder"]),
    ("bag_recorder", ["-p", "output:=/proc/bag"], ["output", "/proc/bag"]),
    ("bag_recorder", ["-p", "output:=there", "-p", "custom_data:=x"], ["custom_data", "JSON"]),
]


@pytest.mark.parametrize(
    ("node", "arguments", "named"),
    WRONG_PARAMETERS,
    ids=[f"{node} {' '.join(arguments)}" for node, arguments, _ in WRONG_PARAMETERS],
)
def test_node_refuses_a_wrong_parameter_in_one_line(node, arguments, named, tmp_path):
    with claimed_domain() as domain:
        done = subprocess.run(
            [node, "--ros-args", *arguments],
            cwd=tmp_path,
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )
    assert done.returncode == 2
    assert_one_line(done.stderr, named)
    assert done.stderr.startswith(f"{node}: ")
    assert list(tmp_path.iterdir()) == []


def test_unknown_parameters_are_warned_about_in_one_line(tmp_path):
    file = tmp_path / "shared.yaml"
    file.write_text("/**: {ros__parameters: {masss: 80.0, camera.rate: 30, mass: 80.0}}")
    with claimed_domain() as domain, probe(domain) as listener:
        node = subprocess.Popen(
            ["walker_sim", "--ros-args", "--params-file", str(file)],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            listener.call(Ready, "walker_sim/ready")
        finally:
            node.terminate()
            _, text = node.communicate(timeout=TIMEOUT)
    assert node.returncode == 0
    warning, started = text.splitlines()
    for word in ("[WARN]", "walker_sim", "ignored: masss (mass?), camera.rate"):
        assert word in warning
    assert "started in ROS domain" in started


def test_second_experiment_in_a_domain_is_refused():
    with claimed_domain() as domain, probe(domain) as listener:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        analyzers = [subprocess.Popen(["gait_analyzer"], env=environment) for _ in range(2)]
        try:
            names = listener.node.get_node_names
            listener.until(lambda: names().count("gait_analyzer") == 2, "the analyzers")
            protocol = r'protocol:="baseline: 4\n"'
            words = ["participants:=[gait_analyzer]", "ready_timeout:=3.0", protocol]
            done = subprocess.run(
                ["experiment", "--ros-args", *(w for word in words for w in ("-p", word))],
                env=environment,
                capture_output=True,
                text=True,
                timeout=TIMEOUT,
                check=False,
            )
        finally:
            for analyzer in analyzers:
                analyzer.terminate()
                analyzer.wait()
    assert done.returncode == 1
    assert "there are two gait_analyzer in /: another experiment runs here" in done.stderr


def test_arguments_that_ros_cannot_read_are_refused(tmp_path):
    for arguments in (["--ros-args", "-p", "mass"], ["--ros-args", "--bogus"], ["--mass", "80"]):
        done = subprocess.run(["walker_sim", *arguments], capture_output=True, text=True)
        assert done.returncode == 2
        assert done.stderr.splitlines()[-1].startswith("walker_sim: ")
        assert arguments[-1] in done.stderr or arguments[-2] in done.stderr
        assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []
