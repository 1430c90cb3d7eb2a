"""Flights and vehicles that live in memory as files that the program reads; nothing of them is left afterwards."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from os import fspath
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from . import _core, _errors, _flight
from ._core import GliderError

FLIGHT = "a path, what read() returns, a Dataset or a DataFrame"
VEHICLE = "the path of a vehicle file, the name of a built-in vehicle, or a dictionary"


class Files:
    """Temporary files of one call, and what they are called in messages."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="glider-")
        self._names: dict[str, str] = {}
        self._count = 0

    def __enter__(self) -> Files:
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def new(self, file: str, name: str = "") -> Path:
        """A name for a file that is not there yet; `name` is the argument that it stands for."""
        self._count += 1
        folder = Path(self._folder.name) / str(self._count)
        folder.mkdir()
        return self.named(folder / file, name or file)

    def named(self, path: Path, name: str) -> Path:
        """A path, and what it is called in messages and documents."""
        self._names[str(path)] = name
        return path

    def run(self, *arguments: Any) -> tuple[dict[str, Any], bool]:
        """Runs a command: its document, and whether its result is positive."""
        try:
            text, positive = _core.command([str(a) for a in arguments])
        except GliderError as e:
            raise self.said(e) from None
        for path, name in sorted(self._names.items(), key=lambda n: -len(n[0])):
            text = text.replace(path, json.dumps(name)[1:-1])
        return json.loads(text), positive

    def read(self, paths: Sequence[str]) -> tuple[Any, ...]:
        """Reads files of a flight."""
        try:
            return _core.read(paths)
        except GliderError as e:
            raise self.said(e) from None

    def said(self, error: GliderError) -> GliderError:
        """The same error in the words of Python."""
        text = _errors.in_words_of_python(str(error), self._names)
        missing = "no such vehicle" in text or "no such flight" in text or "no such file" in text
        return (NotFound if missing else GliderError)(text)

    def dataset(self, flight: Any, name: str = "flight") -> xr.Dataset:
        """A flight of any kind as a Dataset."""
        if isinstance(flight, xr.Dataset):
            of_one_dimension(flight, name)
            time = _flight.time_of(flight, name)
            file = self.new(f"{_stem(flight)}.nc", name)
            kept = flight.assign_coords({str(time.name): time}) if time.name in flight.variables else flight
            try:
                kept.drop_vars([v for v in map(str, kept.variables) if kept[v].dtype.kind == "O"]).to_netcdf(file)
            except (ValueError, ImportError) as e:
                raise GliderError(f"{name}: the Dataset cannot be handed over ({e}); pip install 'glider-workbench[netcdf]'") from None
            return _flight.placed(_flight.dataset(self.read([str(file)]), str(flight.attrs.get("source", name))), flight, name)
        if isinstance(flight, pd.DataFrame):
            file = self.new("flight.csv", name)
            _table(flight, name).to_csv(file, index=False, date_format="%Y-%m-%dT%H:%M:%S.%fZ")
            return _flight.placed(_flight.dataset(self.read([str(file)]), name), _as_dataset(_table(flight, name)), name)
        if isinstance(flight, (list, tuple)) and flight and all(map(_errors.is_path, flight)):
            paths = [_errors.there(f"{name}[{k}]", f) for k, f in enumerate(flight)]
        elif _errors.is_path(flight):
            paths = [_errors.there(name, flight)]
        else:
            _errors.wrong_type(name, flight, FLIGHT)
        out = _flight.dataset(self.read(paths), ", ".join(paths))
        if "latitude" not in out.variables and [Path(p).suffix for p in paths] == [".nc"]:
            with suppress(ImportError, OSError, ValueError, GliderError), xr.open_dataset(paths[0], decode_timedelta=False) as source:
                return _flight.placed(out, source, name)
        return out

    def flight(self, flight: Any, name: str = "flight") -> str:
        """A path for a flight of any kind, which a command takes."""
        if _errors.is_path(flight):
            path = Path(_errors.there(name, flight))
            if (path / "flight.csv").is_file() or (path.suffix.lower() == ".csv" and _is_flight_csv(path)):
                return str(path)
        of_flight = isinstance(flight, (xr.Dataset, pd.DataFrame)) and _flight.is_flight(list(map(str, flight)))
        if not of_flight:
            flight = self.dataset(flight, name)
        if isinstance(flight, pd.DataFrame):
            flight = _as_dataset(_table(flight, name))
        of_one_dimension(flight, name)
        return self._written(flight, name)

    def _written(self, flight: xr.Dataset, name: str) -> str:
        table, start = _flight.rows(flight, name)
        if table.empty:
            raise GliderError(f"{name}: no rows; give a flight with some")
        folder = self.new(_stem(flight), name)
        folder.mkdir()
        table.to_csv(folder / "flight.csv", index=False)
        if start is not None:
            (folder / "import.json").write_text(_flight.import_json(start))
        vehicle = flight.attrs.get("vehicle")
        if isinstance(vehicle, str):
            self.named(folder / "vehicle.json", f'{name}.attrs["vehicle"]').write_text(vehicle)
        return str(folder)

    def several(self, flights: Any) -> list[str]:
        """Paths for one flight or several."""
        many = isinstance(flights, (list, tuple))
        if many and not flights:
            raise GliderError("flights: an empty list; give one flight at least")
        return [self.flight(f, f"flights[{k}]") for k, f in enumerate(flights)] if many else [self.flight(flights, "flights")]

    def mission(self, flights: Any) -> list[str]:
        """Paths for the flights of a mission, of which one may be a folder of flight directories."""
        several = list(flights) if isinstance(flights, (list, tuple)) else [flights]
        if not several:
            raise GliderError("flights: an empty list; give one flight at least")
        out = []
        for k, one in enumerate(several):
            inside = _errors.is_path(one) and Path(fspath(one)).is_dir() and any(Path(fspath(one)).glob("*/flight.csv"))
            out.append(fspath(one) if inside else self.flight(one, f"flights[{k}]" if len(several) > 1 else "flights"))
        return out

    def vehicle(self, vehicle: Any) -> list[str]:
        """The option that names a vehicle file; none where it is the one next to the flight."""
        if vehicle is None:
            return []
        if isinstance(vehicle, Mapping):
            out = self.new("vehicle.json", "vehicle")
            out.write_text(json.dumps(_plain(vehicle, "vehicle")))
            return ["--vehicle", str(out)]
        if not _errors.is_path(vehicle):
            _errors.wrong_type("vehicle", vehicle, VEHICLE)
        if not fspath(vehicle):
            raise NotFound(f"vehicle: an empty path; give {VEHICLE}")
        return ["--vehicle", fspath(vehicle)]

    def vehicle_of(self, path: str) -> list[str]:
        """The option that names the vehicle file next to a flight, or the first flight of a folder."""
        folder = Path(path) if Path(path).is_dir() else Path(path).parent
        for inside in (folder, *sorted(p.parent for p in folder.glob("*/flight.csv"))):
            for name in ("vehicle.json", "vehicle.toml"):
                if (inside / name).is_file():
                    return ["--vehicle", str(inside / name)]
        raise GliderError(f"vehicle: none came with the flights; give {VEHICLE}")


NotFound = _errors.NotFoundError


def of_one_dimension(flight: xr.Dataset, name: str) -> None:
    """Refuses a product on a grid."""
    wide = [str(v) for v in flight.data_vars if flight[v].ndim > 1]
    if wide:
        raise GliderError(f"{name}: {wide[0]} has the dimensions {flight[wide[0]].dims}, a gridded product; give the time series that it was made from")


def _stem(flight: xr.Dataset) -> str:
    named = Path(str(flight.attrs.get("name", "") or "flight")).stem
    return "".join(c if c.isalnum() or c in "-_. " else "_" for c in named).strip(". ") or "flight"


def _is_flight_csv(path: Path) -> bool:
    with path.open(errors="replace") as lines:
        header = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    return "time_s" in header and "pressure" in header


def _table(flight: pd.DataFrame, name: str) -> pd.DataFrame:
    if flight.empty:
        raise GliderError(f"{name}: an empty DataFrame; give a flight with rows")
    if isinstance(flight.columns, pd.MultiIndex):
        if flight.columns.nlevels != 2:
            raise GliderError(f"{name}: columns of {flight.columns.nlevels} levels; give names, and units below them")
        flight = flight.set_axis([c if u.startswith("Unnamed") else f"{c} ({u})" for c, u in flight.columns], axis=1)
    out = flight.reset_index() if flight.index.name or isinstance(flight.index, pd.DatetimeIndex) else flight
    return out.rename(columns={"index": "time"}).rename(columns=str)


def _as_dataset(table: pd.DataFrame) -> xr.Dataset:
    columns: dict[str, Any] = {}
    for column in table:
        values = table[column]
        if isinstance(values.dtype, pd.DatetimeTZDtype):
            values = values.dt.tz_convert("UTC").dt.tz_localize(None)
        columns[str(column)] = ("row", values.to_numpy())
    return xr.Dataset(columns)


def _plain(value: Any, name: str) -> Any:
    """A document of plain numbers and texts: those of numpy are not JSON's."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v, f"{name}[{str(k)!r}]") for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v, name) for v in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist(), name)
    if isinstance(value, float) and not math.isfinite(value):
        raise GliderError(f"{name}: {value} is no number; give one, or leave the key out")
    if value is not None and not isinstance(value, (bool, int, float, str)):
        _errors.wrong_type(name, value, "a number, a text, a list or a dictionary")
    return value
