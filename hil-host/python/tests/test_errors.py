"""Wrong uses: each raises a Python exception of the right type, which names the argument and says what to do."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import glider_workbench as gw

Use = Callable[["Given"], Any]


class Given:
    """What the uses are made of."""

    def __init__(self, trial: Path, folder: Path) -> None:
        self.trial, self.folder = trial, folder
        self.flight = gw.read(trial)
        self.vehicle = json.loads((trial / "vehicle.json").read_text())

    def file(self, name: str, text: str) -> Path:
        """A file of a user."""
        path = self.folder / name
        path.write_text(text)
        return path

    def heavy(self) -> dict[str, Any]:
        """A vehicle that sinks like a stone."""
        return {**self.vehicle, "mass_kg": "heavy"}


@pytest.fixture
def given(trial: Path, tmp_path: Path) -> Given:
    return Given(trial, tmp_path)


def gridded(g: Given) -> xr.Dataset:
    return xr.Dataset({"pressure_dbar": (("time", "depth"), np.zeros((3, 2)))}, coords={"time": np.arange(3.0)})


def without(g: Given, column: str) -> xr.Dataset:
    return g.flight.drop_vars(column)


def backwards(g: Given) -> xr.Dataset:
    return g.flight.isel(time=slice(None, None, -1))


# What is done; the exception; what its message has to say: the argument, and the remedy.
WRONG: list[tuple[Use, type[Exception], str, str]] = [
    (lambda g: gw.read(None), TypeError, "flight", "path"),
    (lambda g: gw.read(42), TypeError, "flight", "DataFrame"),
    (lambda g: gw.read([]), TypeError, "flight", "give"),
    (lambda g: gw.read(""), FileNotFoundError, "flight", "paths count from"),
    (lambda g: gw.read(g.folder / "nowhere"), FileNotFoundError, "nowhere", "no such"),
    (lambda g: gw.read([g.trial, g.folder / "p1.nc"]), FileNotFoundError, r"flight\[1\]", "no such"),
    (lambda g: gw.read(g.folder), ValueError, "has no file of a known kind", "csv"),
    (lambda g: gw.read(g.file("notes.docx", "hello")), ValueError, "notes.docx", "of no known kind"),
    (lambda g: gw.read(g.file("empty.nc", "")), ValueError, "empty.nc", "is empty"),
    (lambda g: gw.read(g.file("flight.csv", "time_s,pressure_dbar\n0,1\nx,2\n")), ValueError, "flight.csv", "pressure|ballast|time"),
    (lambda g: gw.read(gridded(g)), ValueError, "flight", "give the time series"),
    (lambda g: gw.compare(gridded(g), g.vehicle), ValueError, "flight", "gridded product"),
    (lambda g: gw.read(pd.DataFrame()), ValueError, "flight", "with rows"),
    (lambda g: gw.compare(g.flight.drop_vars("time"), g.vehicle), ValueError, "flight", "call a coordinate `time`"),
    (lambda g: gw.compare(without(g, "m_ballast_pumped_cc"), g.vehicle), ValueError, "flight.*m_ballast_pumped_cc", "without it"),
    (lambda g: gw.compare(backwards(g), g.vehicle), ValueError, r"flight, row \d+.*time", "sort the rows"),
    (lambda g: gw.compare(g.flight.isel(time=slice(0, 0)), g.vehicle), ValueError, "flight", "rows"),
    (lambda g: gw.compare(g.flight.assign(m_pitch_rad=57.3 * g.flight.m_pitch_rad), g.vehicle), ValueError, "flight.*m_pitch_rad", "rad"),
    (lambda g: gw.compare(None), TypeError, "flight", "path"),
    (lambda g: gw.compare(g.flight.drop_attrs()), ValueError, "vehicle", "name one with vehicle="),
    (lambda g: gw.compare(g.trial, 3.0), TypeError, "vehicle", "dictionary"),
    (lambda g: gw.compare(g.trial, "no_such_vehicle.toml"), FileNotFoundError, "no_such_vehicle", "no such|built"),
    (lambda g: gw.compare(g.trial, ""), FileNotFoundError, "vehicle", "give"),
    (lambda g: gw.compare(g.trial, {}), ValueError, "vehicle", "missing|expected"),
    (lambda g: gw.compare(g.trial, g.heavy()), ValueError, "vehicle.*mass_kg", "number"),
    (lambda g: gw.compare(g.trial, {**g.vehicle, "mass_kg": float("nan")}), ValueError, "vehicle.*mass_kg", "leave the key out"),
    (lambda g: gw.compare(g.trial, {**g.vehicle, "mass_kg": object()}), TypeError, "vehicle.*mass_kg", "give a number"),
    (lambda g: gw.diagnose(g.trial, depth=5), ValueError, "depth", "from 2 to 3"),
    (lambda g: gw.diagnose(g.trial, depth="two"), TypeError, "depth", "whole number"),
    (lambda g: gw.diagnose(g.trial, depth=3, quick=True), ValueError, "quick", "give one of them"),
    (lambda g: gw.diagnose(g.trial, quick="yes"), TypeError, "quick", "True or False"),
    (lambda g: gw.diagnose(g.trial, history=g.folder / "no.history"), FileNotFoundError, "history", "no such"),
    (lambda g: gw.diagnose(g.trial, history=1), TypeError, "history", "calibrate"),
    (lambda g: gw.add(g.trial, "drg"), ValueError, "drg", r'names\("effects"\)'),
    (lambda g: gw.add(g.trial, []), ValueError, "effects", "names"),
    (lambda g: gw.add(g.trial, [None]), TypeError, r"effects\[0\]", "name of an effect"),
    (lambda g: gw.add(g.trial, "cd += k*"), ValueError, "expression, character 9", "a value is missing at the end"),
    (lambda g: gw.add(g.trial, ["drag_level_error", "drag_level_error"]), ValueError, "drag_level_error", "name every effect once"),
    (lambda g: gw.calibrate([]), ValueError, "flights", "at least"),
    (lambda g: gw.calibrate([g.trial, None]), TypeError, r"flights\[1\]", "path"),
    (lambda g: gw.calibrate([g.trial, g.trial]), ValueError, "same log", "name every flight once"),
    (lambda g: gw.calibrate(g.trial, free=["drg"]), ValueError, "free drg", "there are"),
    (lambda g: gw.calibrate(g.trial, free=3), TypeError, "free", "list"),
    (lambda g: gw.timeline(g.trial, dives_per_alarm=1), ValueError, "dives_per_alarm", "from 10"),
    (lambda g: gw.timeline([], g.vehicle), ValueError, "flights", "at least"),
    (lambda g: gw.timeline(g.flight.drop_attrs()), ValueError, "vehicle", "give"),
    (lambda g: gw.report(g.trial, "page.pdf"), ValueError, "out", r"\.html"),
    (lambda g: gw.report(g.trial, g.folder / "no" / "page.html"), FileNotFoundError, "out", "make it first"),
    (lambda g: gw.report(g.trial, None), TypeError, "out", "path"),
    (lambda g: gw.polar(None), TypeError, "vehicle", "built-in"),
    (lambda g: gw.polar("slocum-standard", to=0), ValueError, "to", "from 1 to 90"),
    (lambda g: gw.polar("slocum-standard", step="fine"), TypeError, "step", "number"),
    (lambda g: gw.polar("slocum-standard", effects=["drag"]), TypeError, "effects", "dictionary"),
    (lambda g: gw.polar("slocum-standard", effects={"drg": 1.0}), ValueError, "drg", "drag_level_error|names"),
    (lambda g: gw.names("fish"), ValueError, "what", "effects"),
    (lambda g: gw.vehicle(g.flight.drop_attrs()), ValueError, "vehicle", "built-in"),
    (lambda g: gw.history(g.folder / "no.history"), FileNotFoundError, "history", "no such"),
    (lambda g: gw.history(g.file("a.history", "x")), ValueError, "history", "."),
    (lambda g: gw.fleet(g.trial, g.folder / "fleet.csv"), ValueError, "out", r"\.parquet"),
    (lambda g: gw.fleet(None, g.folder / "fleet.parquet"), TypeError, "paths", "archive"),
    (lambda g: gw.fleet(g.trial, g.folder / "f.parquet", jobs=0), ValueError, "jobs", "from 1"),
    (lambda g: gw.fleet(g.trial, g.folder / "f.parquet", client="tcp://head:8786"), TypeError, "client", "Client"),
    (lambda g: gw.merge("part.parquet"), TypeError, "parts", "list"),
    (lambda g: gw.merge([g.trial / "flight.csv"]), ValueError, "flight.csv", "Parquet"),
    (lambda g: gw.table(g.folder / "no.parquet"), FileNotFoundError, "path", "no such"),
    (lambda g: gw.faults(sample=0), ValueError, "sample", "from 1"),
    (lambda g: gw.faults(only="nothing:like_this"), ValueError, "only|no case has this", "."),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(WRONG)))
def test_a_wrong_use_raises_what_says_the_argument_and_the_remedy(number: int, given: Given) -> None:
    use, kind, argument, remedy = WRONG[number]
    with pytest.raises(kind) as raised:
        use(given)
    said = str(raised.value)
    assert isinstance(raised.value, (TypeError, gw.GliderError)), type(raised.value)
    for what in (argument, remedy):
        assert re.search(what, said, re.DOTALL), f"no {what!r} in: {said}"
    foreign = re.search(r"glider-[a-z0-9_]{8}|--[a-z]|Usage|--help|^error:|\bglider [a-z]+-?[a-z]* ", said)
    assert not foreign, f"{foreign[0]!r} in: {said}"


def test_there_are_more_than_forty() -> None:
    assert len(WRONG) >= 40
