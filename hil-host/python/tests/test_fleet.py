"""Fleets from Python: one process, and a Dask cluster of three workers of which one is killed; Python reads what Rust wrote."""

import hashlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

import glider_workbench as gw


@pytest.fixture(scope="module")
def whole(archive: Path, tmp_path_factory: pytest.TempPathFactory) -> gw.Fleet:
    return gw.fleet(archive, tmp_path_factory.mktemp("whole") / "fleet.parquet")


def test_a_fleet_is_a_frame_of_dives_and_one_of_numbers(whole: gw.Fleet) -> None:
    assert len(whole.dives) == 32 and set(whole.dives["deployment"]) == {"archive/may", "archive/june"}
    assert whole.dives.attrs["units"]["drag"] == "%"
    numbers = whole.numbers.set_index("name")
    assert numbers.loc["drag", "dives"] == 32 and (numbers["q"] >= numbers["p"]).all()
    assert (numbers["low"] <= numbers["high"]).all()
    weight = whole.dives["drag_noise"] ** -2
    mean = (whole.dives["drag"] * weight).sum() / weight.sum()
    # With scatter between dives the weights are nearer each other: within the interval of the pooled value.
    assert abs(mean - numbers.loc["drag", "value"]) < 3 * numbers.loc["drag", "sigma"]


def test_the_digest_is_the_files(archive: Path, tmp_path: Path, whole: gw.Fleet) -> None:
    out = tmp_path / "again.parquet"
    again = gw.fleet(archive, out)
    assert again.sha256 == whole.sha256 == hashlib.sha256(out.read_bytes()).hexdigest()
    kept = gw.fleet(archive, out)
    assert kept.sha256 == whole.sha256
    with pytest.raises(gw.GliderError, match="Parquet"):
        gw.merge([archive / "may/flight0/flight.csv"])


def test_a_cluster_with_a_worker_killed_gives_the_same_digest(
    archive: Path, tmp_path: Path, whole: gw.Fleet, client: Any, worker_killed: Callable[[Path], AbstractContextManager[list[int]]]
) -> None:
    with worker_killed(tmp_path / "fleet.parquet.cache") as counts:
        found = gw.fleet(archive, tmp_path / "fleet.parquet", client=client, shards=4)
    assert counts and counts[0] < 4, "the worker was killed after the work was done"
    assert found.sha256 == whole.sha256
