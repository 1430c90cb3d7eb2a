"""A fleet's archive, on one machine or on the workers of a Dask cluster."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from . import _core, _errors
from ._answers import answer
from ._core import GliderError
from ._files import Files

if TYPE_CHECKING:
    from distributed import Client


@dataclass
class Fleet:
    """What all dives of an archive say."""

    dives: pd.DataFrame
    """One row a dive: every number with its three kinds of error (docs/fleet.md)."""
    numbers: pd.DataFrame
    """Every number pooled over dives, deployments and vehicles; ``named`` are those that are real at the share of false names asked for."""
    sha256: str
    """Digest of the table of dives: the same for any number of shards, workers and breaks."""
    document: dict[str, Any]
    """All that ``glider fleet --json`` says."""


def table(path: str | os.PathLike[str]) -> pd.DataFrame:
    """Reads a table that ``glider fleet`` or ``glider timeline`` wrote as Parquet."""
    if not _errors.is_path(path):
        _errors.wrong_type("path", path, "the path of a table (.parquet)")
    whole, texts, numbers, about = _core.table(_errors.there("path", path))
    columns: dict[str, Any] = {name: np.array(values, dtype=np.int32) for name, values in whole}
    columns.update(texts)
    columns.update({name: np.frombuffer(raw, dtype=np.float64).copy() for name, raw in numbers})
    out = pd.DataFrame(columns)
    out.attrs["units"] = json.loads(dict(about).get("units", "{}"))
    return out


def merge(parts: Sequence[str | os.PathLike[str]], out: str | os.PathLike[str] | None = None, *, false_names: float = 0.05) -> Fleet:
    """Puts the parts of all shards together and pools them; one whole table is pooled again."""
    if _errors.is_path(parts) or not isinstance(parts, Sequence):
        _errors.wrong_type("parts", parts, "a list of paths")
    if not parts:
        raise GliderError("parts: an empty list; give the files that the shards wrote")
    named = [_errors.there(f"parts[{k}]", p) for k, p in enumerate(parts)]
    share = _errors.number("false_names", false_names, 1e-6, 0.5)
    how = ["--out", _errors.path("out", out)] if out is not None else []
    with Files() as files:
        d, _ = files.run("--force", "fleet", "merge", *named, *how, "--false-names", share)
    headline = f"{d['dives']} dives of {d['vehicles']} vehicles"
    return Fleet(table(out if out is not None else parts[0]), answer(d["numbers"], d, {}, headline), d["sha256"], d)


def _shard(paths: list[str], vehicle: Any, shard: str, cache: str) -> bytes:
    """One part, on a worker: its file's bytes, so that workers need no folder in common but the archive."""
    with Files() as files:
        out = files.new("part.parquet")
        files.run("fleet", *paths, *files.vehicle(vehicle), "--shard", shard, "--cache", cache, "--out", out, "--jobs", 1)
        return out.read_bytes()


def fleet(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    vehicle: Any = None,
    *,
    cache: str | os.PathLike[str] | None = None,
    jobs: int = 2,
    false_names: float = 0.05,
    client: Client | None = None,
    shards: int | None = None,
) -> Fleet:
    """Asks every dive of an archive and pools what they say; ``out`` is where the table of dives goes (.parquet).

    What is done is kept in ``cache`` (default: next to ``out``), flight by flight, so that a call that was broken off goes on where it was. With a
    Dask ``client`` the flights are dealt to its workers in ``shards`` parts (default: four a worker); every worker must see the archive
    under the same path, and what a worker that dies has not handed in is done by another.
    """
    if not _errors.is_path(paths) and not isinstance(paths, Sequence):
        _errors.wrong_type("paths", paths, "the path of an archive, or a list of them")
    several: list[Any] = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    named = [str(Path(_errors.there("paths", p)).resolve()) for p in several]
    _errors.whole("jobs", jobs, 1, 1024)
    if not _errors.path("out", out).endswith(".parquet"):
        raise GliderError(f"out: {fspath(out)}: the table of dives is Parquet; name a file that ends in .parquet")
    cluster: Any = client
    if client is not None and not hasattr(client, "scheduler_info"):
        _errors.wrong_type("client", client, "a dask.distributed.Client")
    kept = str(Path(fspath(cache) if cache is not None else f"{fspath(out)}.cache").resolve())
    if client is None:
        with Files() as files:
            files.run("--force", "fleet", *named, *files.vehicle(vehicle), "--cache", kept, "--jobs", jobs, "--out", fspath(out))
        return merge([out], None, false_names=false_names)
    if vehicle is not None and not isinstance(vehicle, Mapping):
        vehicle = str(Path(fspath(vehicle)).resolve())
    count = shards or 4 * max(1, len(cluster.scheduler_info()["workers"]))
    tasks = [cluster.submit(_shard, named, vehicle, f"{i}/{count}", kept, pure=False) for i in range(1, count + 1)]
    with Files() as files:
        parts = [files.new("part.parquet") for _ in tasks]
        for part, data in zip(parts, cluster.gather(tasks)):
            part.write_bytes(data)
        return merge(parts, out, false_names=false_names)
