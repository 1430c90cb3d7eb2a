"""The fault campaign, on one machine or on the workers of a Dask cluster."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from . import _errors
from ._answers import answer
from ._files import Files

if TYPE_CHECKING:
    from distributed import Client


@dataclass
class Faults:
    """What the controller made of every fault."""

    cases: pd.DataFrame
    """One row a mission: its faults, how it ended, its abort and the delay of that, what it broke (docs/faults.md)."""
    by_fault: pd.DataFrame
    """One row a fault alone: what it is owed, and the longest delays seen."""
    passed: bool
    """Every mission was as it should be."""
    sha256: str
    """Digest of the report: the same for any number of shards, workers and breaks."""
    document: dict[str, Any]
    """All that ``glider faults --json`` says."""


def _report(files: Files, words: Sequence[Any], out: Path, html: Path) -> Faults:
    d, positive = files.run("--force", "faults", *words, "--out", out, "--html", html)
    said = f"{d['summary']['missions']} missions, {d['summary']['safe']} safe"
    cases = answer(json.loads(out.read_text())["cases"], d, {"latency_s": "s", "max_depth_m": "m", "budget_n": "N", "budget_at_m": "m"}, said)
    units = {"bound_s": "s", "worst_of_bound_s": "s", "worst_latency_s": "s", "worst_after_sign_s": "s"}
    return Faults(cases, answer(d["by_fault"], d, units, said), positive, d["sha256"], d)


def _shard(plan: list[str], shard: str, cache: str | None) -> bytes:
    """One part, on a worker: its file's bytes, so that workers need no folder in common."""
    with Files() as files:
        out = files.new("part.json")
        kept = cache if cache is not None else fspath(files.new("kept"))
        files.run("faults", *plan, "--shard", shard, "--cache", kept, "--out", out, "--jobs", 1)
        return out.read_bytes()


def faults(
    *,
    sample: int | None = None,
    random: int | None = None,
    only: str | None = None,
    seed: int = 0,
    out: str | os.PathLike[str] | None = None,
    html: str | os.PathLike[str] | None = None,
    cache: str | os.PathLike[str] | None = None,
    jobs: int = 0,
    client: Client | None = None,
    shards: int | None = None,
) -> Faults:
    """Flies the fault campaign: ``sample`` missions spread over it (default: all), ``random`` of them random, or ``only`` those with this name.

    What is done is kept in ``cache``, so that a call that was broken off goes on where it was; without it nothing is kept. With a Dask ``client``
    the missions are dealt to its workers in ``shards`` parts (default: four a worker), and what a worker that dies has not handed in is done
    by another; ``cache`` must then be a folder that all of them see. ``out`` and ``html`` are where the list and the page go.
    """
    counts = {"sample": sample, "random": random, "seed": seed, "shards": shards}
    for name, count in counts.items():
        if count is not None:
            _errors.whole(name, count, 0 if name in ("seed", "random") else 1, 2**31)
    _errors.whole("jobs", jobs, 0, 1024)
    if only is not None and not isinstance(only, str):
        _errors.wrong_type("only", only, "a text that the names of missions contain")
    cluster: Any = client
    if client is not None and not hasattr(client, "scheduler_info"):
        _errors.wrong_type("client", client, "a dask.distributed.Client")
    chosen = {"--sample": sample, "--random": random, "--only": only, "--seed": seed}
    plan = [str(part) for option, value in chosen.items() if value is not None for part in (option, value)]
    kept = str(Path(fspath(cache)).resolve()) if cache is not None else None
    with Files() as files:
        to = Path(_errors.path("out", out)) if out is not None else files.new("faults.json")
        page = Path(_errors.path("html", html)) if html is not None else files.new("faults.html")
        if client is None:
            return _report(files, [*plan, "--cache", kept or files.new("kept"), "--jobs", jobs], to, page)
        count = shards or 4 * max(1, len(cluster.scheduler_info()["workers"]))
        tasks = [cluster.submit(_shard, plan, f"{i}/{count}", kept, pure=False) for i in range(1, count + 1)]
        parts = [files.new("part.json") for _ in tasks]
        for part, data in zip(parts, cluster.gather(tasks)):
            part.write_bytes(data)
        return _report(files, ["merge", *parts], to, page)
