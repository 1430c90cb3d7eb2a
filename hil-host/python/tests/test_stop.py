"""Ctrl-C ends the work of Rust: what it was to write is not there; and leaves a module that works."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import glider_workbench as gw
from glider_workbench import _core

#: Long after a command has begun, and long before it is done.
AFTER_S = 0.3


@pytest.mark.parametrize("command", ["calibrate", "report"])
def test_ctrl_c_ends_a_command_before_it_writes_and_the_next_call_works(command: str, archive: Path, tmp_path: Path) -> None:
    flights = sorted(archive.glob("*/flight*"))
    out = tmp_path / ("out.json" if command == "calibrate" else "out.html")
    named = [part for f in (flights if command == "calibrate" else flights[:1]) for part in ("--flight", str(f))]
    threading.Timer(AFTER_S, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        _core.command([command, *named, "--out", str(out)])
    assert not out.exists(), "it went on to its end"
    assert gw.compare(flights[0]).attrs["rms"] > 0
    _core.command(["calibrate", "--flight", str(flights[0]), "--out", str(tmp_path / "again.json")])
    assert (tmp_path / "again.json").is_file()


def test_ctrl_c_ends_a_campaign_on_all_its_threads(tmp_path: Path) -> None:
    threading.Timer(4 * AFTER_S, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        gw.faults(sample=100_000, jobs=2, out=tmp_path / "faults.json", cache=tmp_path / "kept")
    assert not (tmp_path / "faults.json").exists()
    assert len(list((tmp_path / "kept").glob("*.kept"))) < 10_000


def test_a_program_that_was_stopped_ends_as_python_does(archive: Path) -> None:
    program = f"import glider_workbench as gw\nprint('begun', flush=True)\nwhile True: gw.diagnose({str(archive / 'may/flight0')!r})"
    running = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stdout and running.stdout.readline() == "begun\n"
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert running.returncode == -signal.SIGINT and "KeyboardInterrupt" in said and "panicked" not in said
