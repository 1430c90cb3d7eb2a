"""Flights for the tests: simulated by the program itself, so that nothing has to be fetched."""

from pathlib import Path

import pytest

import glider_workbench as gw
from glider_workbench import _core


def fly(folder: Path, seed: int) -> Path:
    """A flight against the simulated vehicle and sea: eight dives, each with its own pitch and drive."""
    _core.command(["fly", "--mission", "sweep", "--seed", str(seed), "--log", str(folder)])
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
