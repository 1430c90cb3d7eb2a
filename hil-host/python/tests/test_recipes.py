"""Every recipe of docs/python.md, run in a folder that has the files it names."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from conftest import fly

import glider_workbench as gw

PAGE = Path(__file__).parents[3] / "docs/python.md"
FORMATS = Path(__file__).parents[2] / "logs/tests/formats"


def recipes() -> list[tuple[str, str]]:
    """Heading and program of each recipe."""
    sections = PAGE.read_text().split("\n## ")[1:]
    return [(s.split("\n", 1)[0], code) for s in sections for code in re.findall(r"```python\n(.*?)```", s, re.DOTALL)]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    plt.close("all")
    yield tmp_path
    plt.close("all")


def pyglider_timeseries(to: Path) -> None:
    """A timeseries as pyglider writes it: the names, units and attributes of its examples, with the ballast of the recipe."""
    flight = gw.read(pd.read_csv(next((FORMATS / "erddap").glob("*.csv")), header=[0, 1]))
    names = {
        "pressure": ("pressure_dbar", 1.0, "dbar"),
        "pitch": ("m_pitch_rad", 180 / np.pi, "degrees"),
        "roll": ("m_roll_rad", 180 / np.pi, "degrees"),
        "ballast_pumped": ("m_ballast_pumped_cc", 1.0, "cm3"),
        "temperature": ("sci_water_temp_degC", 1.0, "Celsius"),
        "density": ("sci_density_kg_m3", 1.0, "kg m-3"),
        "salinity": ("practical_salinity", 1.0, "1e-3"),
    }
    data = {name: ("time", factor * flight[column].values, {"units": unit}) for name, (column, factor, unit) in names.items() if column in flight}
    coords = {"time": flight["time"].values, **{c: ("time", flight[c].values, {"units": flight[c].attrs["units"]}) for c in ("latitude", "longitude", "depth")}}
    to.parent.mkdir()
    xr.Dataset(data, coords=coords, attrs={"title": "unit_777", "processing_level": "L0"}).to_netcdf(to)


def reanalysis(to: Path, flight: xr.Dataset) -> None:
    """Water a degree warmer than the glider measured, on a grid that covers the flight."""
    times = pd.date_range(flight.time.values[0], flight.time.values[-1] + np.timedelta64(6, "h"), freq="6h")
    places = {c: np.arange(float(flight[c].min()) - 0.5, float(flight[c].max()) + 0.5, 0.25) for c in ("latitude", "longitude")}
    depth = np.array([0.5, 10, 30, 60, 100, 200, 400, 700, 1100])
    nearest = np.abs(depth[:, None] - flight.depth.values).argmin(axis=0)
    profile = [float(np.nanmean(flight.sci_water_temp_degC.values[nearest == k])) + 1 if (nearest == k).any() else 0.0 for k in range(len(depth))]
    field = np.broadcast_to(np.array(profile)[None, :, None, None], (len(times), len(depth), *(len(v) for v in places.values())))
    cells = {"thetao": (("time", "depth", "latitude", "longitude"), field, {"units": "degrees_C", "standard_name": "sea_water_potential_temperature"})}
    xr.Dataset(cells, coords={"time": times, "depth": depth, **places}).to_netcdf(to)


def prepare(name: str, place: Path, request: pytest.FixtureRequest) -> None:
    """The files that a recipe names."""
    if name == "My own logs":
        trial: Path = request.getfixturevalue("trial")
        shutil.copy(trial / "flight.csv", place / "unit_595_2016.csv")
        shutil.copy(trial / "vehicle.json", place / "vehicle.json")
    if name in ("After a Seaglider's base station", "Joined with a gridded product", "Units, axes, and a file of one's own"):
        shutil.copytree(request.getfixturevalue("dives"), place / "dives")
    if name == "Joined with a gridded product":
        reanalysis(place / "reanalysis.nc", gw.read(place / "dives"))
    if name == "After pyglider":
        pyglider_timeseries(place / "L0-timeseries/unit_777.nc")
        shutil.copy(FORMATS / "erddap/vehicle.json", place / "vehicle.json")
    if name == "An ERDDAP table":
        names, units, *rows = next((FORMATS / "erddap").glob("*.csv")).read_text().splitlines()
        header = [f"{n} ({u})" if u else n for n, u in zip(names.split(","), units.split(","))]
        (place / "unit_777.csvp").write_text("\n".join([",".join(header), *rows]))
        shutil.copy(FORMATS / "erddap/vehicle.json", place / "vehicle.json")
    if name in ("A vehicle judged by its earlier dives", "The next mission"):
        for seed, month in enumerate(("may", "june", "july"), 5):
            fly(place / month, seed)
    if name == "A Dask cluster":
        shutil.copytree(request.getfixturevalue("archive"), place / "archive")
        shutil.copy(request.getfixturevalue("trial") / "vehicle.json", place / "known.json")


@pytest.mark.parametrize(("name", "program"), recipes(), ids=[f"{k} {name}" for k, (name, _) in enumerate(recipes())])
def test_a_recipe_runs(name: str, program: str, place: Path, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]) -> None:
    prepare(name, place, request)
    if "tcp://head:8786" in program:
        program = program.replace("tcp://head:8786", request.getfixturevalue("client").scheduler.address)
    names: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(program, f"docs/python.md, {name}", "exec"), names)
    said = capsys.readouterr().out
    if name == "After a Seaglider's base station":
        dives = sorted((place / "dives").glob("p*.nc"))
        assert len(dives) >= 10 and (place / "mission.png").stat().st_size > 10_000
        assert "<html" in (place / "first_dives.html").read_text()[:300]
        lines = [line for line in program.split("mission.png")[0].splitlines() if line.strip()]
        assert len(lines) <= 6, lines
    if name == "Joined with a gridded product":
        assert len([line for line in program.splitlines() if line.strip() and "import" not in line and "print" not in line]) <= 4
        # The grid is a degree warmer by construction, but for layers that the glider crosses.
        assert -1.6 < float(said.split()[0]) < -0.4, said
    if name in ("After pyglider", "An ERDDAP table", "My own logs"):
        assert 0 < float(re.search(r"([\d.]+) cm/s", said)[1]) < 50, said


def test_the_page_has_the_recipes_that_were_asked_for() -> None:
    assert len(recipes()) >= 9 and {"After pyglider", "An ERDDAP table", "A Dask cluster"} <= {name for name, _ in recipes()}
