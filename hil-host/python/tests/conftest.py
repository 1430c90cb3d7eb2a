"""Flights for the tests: simulated by the program itself, so that nothing has to be fetched."""

import os
import shutil
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

import glider_workbench as gw
from glider_workbench import _core


def fly(folder: Path, seed: int) -> Path:
    """A flight against the simulated vehicle and sea: eight dives, each with its own pitch and drive."""
    _core.command(["fly", "--mission", "sweep", "--seed", str(seed), "--log", str(folder)])
    return folder


@pytest.fixture
def client() -> Iterator[Any]:
    """The client of a Dask cluster of three processes on this machine."""
    distributed = pytest.importorskip("distributed")
    made = distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None)
    with distributed.Client(made) as connected:
        yield connected
    # Workers that a busy machine does not end within Dask's five seconds are killed; that is no concern of a test.
    with suppress(TimeoutError):
        made.close()


@pytest.fixture
def worker_killed(client: Any) -> Callable[[Path], AbstractContextManager[list[int]]]:
    """One of the cluster's workers is killed as soon as a first result is kept in a folder: how many were kept by then."""
    pids = list(client.run(os.getpid).values())

    @contextmanager
    def worker_killed_in(kept: Path) -> Iterator[list[int]]:
        counts: list[int] = []

        def kill() -> None:
            until = time.monotonic() + 60
            while time.monotonic() < until and not any(kept.glob("*.kept")):
                time.sleep(0.005)
            os.kill(pids[0], signal.SIGKILL)
            counts.append(len(list(kept.glob("*.kept"))))

        killer = threading.Thread(target=kill)
        killer.start()
        yield counts
        killer.join()

    return worker_killed_in


@pytest.fixture(scope="session")
def dives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten dives or more of a real Seaglider, as its base station left them: of GLIDER_FLIGHTS, else of scripts/fetch-samples."""
    samples = Path(__file__).parents[3] / "data-cache/samples"
    named = Path(os.environ.get("GLIDER_FLIGHTS", "nowhere")) / "seaglider_sg171_dives"
    files = sorted(named.glob("p*.nc")) or sorted(samples.glob("glidertools-*/tests/data/p542*.nc"))
    if len(files) < 10:
        warnings.warn("SKIPPED LOUDLY: no dives of a real Seaglider (GLIDER_FLIGHTS, or scripts/fetch-samples)", stacklevel=1)
        pytest.skip("no dives of a real Seaglider")
    folder = tmp_path_factory.mktemp("seaglider") / "dives"
    folder.mkdir()
    for file in files:
        shutil.copy(file, folder)
    return folder


@pytest.fixture(scope="session")
def trial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A flight directory."""
    return fly(tmp_path_factory.mktemp("trial") / "flight", 1)


@pytest.fixture(scope="session")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An archive of four flights of two deployments."""
    root = tmp_path_factory.mktemp("fleet") / "archive"
    for deployment in ("may", "june"):
        (root / deployment).mkdir(parents=True)
        for k in range(2):
            fly(root / deployment / f"flight{k}", 10 * len(deployment) + k)
    return root


@pytest.fixture(scope="session")
def known(trial: Path) -> dict:
    """The vehicle, calibrated on the trial."""
    return gw.calibrate(trial)[0]
