"""Ctrl-C ends the work of Rust, and leaves a module that works."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import glider_workbench as gw

#: Longer than a simulation and the time between two looks for signals, on a busy machine; a diagnosis takes as long many times over.
SOON_S = 3.0


def test_ctrl_c_ends_a_diagnosis_and_the_next_call_works(archive: Path) -> None:
    flights = [archive / "may/flight0", archive / "may/flight1"]
    begun = time.perf_counter()
    timer = threading.Timer(0.4, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(1000):
            gw.calibrate(flights)
    assert 0.4 <= time.perf_counter() - begun < 0.4 + SOON_S
    assert gw.compare(archive / "may/flight0").attrs["rms"] > 0


def test_ctrl_c_ends_a_campaign_of_many_threads(tmp_path: Path) -> None:
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    begun = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        gw.faults(sample=100_000, jobs=2, out=tmp_path / "faults.json")
    assert time.perf_counter() - begun < 1.0 + 2 * SOON_S and not (tmp_path / "faults.json").exists()


def test_a_program_that_was_stopped_ends_as_python_does(archive: Path) -> None:
    program = f"import glider_workbench as gw\nprint('begun', flush=True)\nfor _ in range(1000): gw.diagnose({str(archive / 'may/flight0')!r})"
    running = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stdout and running.stdout.readline() == "begun\n"
    time.sleep(0.5)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=30)
    assert running.returncode == -signal.SIGINT and "KeyboardInterrupt" in said and "panicked" not in said
