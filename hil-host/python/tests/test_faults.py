"""The fault campaign from Python: one process, and a Dask cluster of three workers of which one is killed."""

import hashlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

import glider_workbench as gw

CAMPAIGN = {"sample": 60, "random": 12, "seed": 5}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> gw.Faults:
    return gw.faults(**CAMPAIGN, out=tmp_path_factory.mktemp("whole") / "faults.json")


def test_a_campaign_is_a_frame_of_missions_and_one_of_faults(whole: gw.Faults, tmp_path: Path) -> None:
    assert whole.document["summary"]["missions"] <= len(whole.cases)
    assert {"case", "end", "abort", "latency_s", "came_home"} <= set(whole.cases.columns)
    assert whole.cases.attrs["units"]["latency_s"] == "s"
    assert (whole.by_fault["missions"] >= whole.by_fault["aborted"]).all() and whole.passed
    out = tmp_path / "again.json"
    again = gw.faults(**CAMPAIGN, out=out, cache=tmp_path / "kept", jobs=1)
    assert again.sha256 == whole.sha256 == hashlib.sha256(out.read_bytes()).hexdigest()
    with pytest.raises(gw.GliderError, match="no case has this"):
        gw.faults(only="nothing:like_this")


def test_a_cluster_with_a_worker_killed_gives_the_same_report(
    tmp_path: Path, whole: gw.Faults, client: Any, worker_killed: Callable[[Path], AbstractContextManager[list[int]]]
) -> None:
    kept = tmp_path / "kept"
    with worker_killed(kept) as counts:
        found = gw.faults(**CAMPAIGN, client=client, shards=6, cache=kept)
    assert counts and counts[0] < len(list(kept.glob("*.kept"))), "the worker was killed after the work was done"
    assert found.sha256 == whole.sha256
