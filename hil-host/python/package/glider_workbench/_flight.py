"""Flights as Datasets by the CF conventions, and back."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ._core import GliderError

#: Column of the flight format: standard name (CF), what it is.
_CF = {
    "pressure_dbar": ("sea_water_pressure_due_to_sea_water", "gauge pressure"),
    "m_pitch_rad": ("platform_pitch_fore_up", "pitch, nose up"),
    "m_roll_rad": ("platform_roll_starboard_down", "roll, starboard down"),
    "m_heading_rad": ("platform_orientation", "heading, clockwise from true north"),
    "m_ballast_pumped_cc": (None, "volume of the buoyancy engine from its middle, positive buoyant"),
    "m_battpos_m": (None, "position of the battery, positive forward"),
    "sci_water_temp_degC": ("sea_water_temperature", "temperature of the water in situ"),
    "sci_density_kg_m3": ("sea_water_density", "density of the water in situ"),
    "practical_salinity": ("sea_water_practical_salinity", "practical salinity"),
    "gps_east_m": (None, "GPS fix, east of the segment's first"),
    "gps_north_m": (None, "GPS fix, north of the segment's first"),
    "speed_water_m_s": ("platform_speed_wrt_sea_water", "speed through the water"),
    "latitude_gps": ("latitude", "latitude of the GPS fixes"),
    "longitude_gps": ("longitude", "longitude of the GPS fixes"),
    "latitude": ("latitude", "latitude, between GPS fixes on the straight line"),
    "longitude": ("longitude", "longitude, between GPS fixes on the straight line"),
    "depth": ("depth", "depth below the surface"),
    "segment": (None, "number of the segment, from one surfacing to the next"),
}
_AXIS = {"latitude": {"axis": "Y"}, "longitude": {"axis": "X"}, "depth": {"axis": "Z", "positive": "down"}}
#: Spellings that UDUNITS, pint and cf-xarray all read.
_UNITS = {"cm3": "cm^3", "kg m-3": "kg/m^3", "m s-1": "m/s", "°": "degree", "deg": "degree"}
#: Coordinates that are computed when a flight is read.
COMPUTED = ("latitude", "longitude", "depth", "latitude_gps", "longitude_gps")
FORMAT = "glider-trial/1"


def unit(text: str) -> str:
    """A unit in the spelling of Datasets."""
    return _UNITS.get(text, text)


def dataset(read: tuple[Any, ...], source: str) -> xr.Dataset:
    """What `_core.read` returns as a Dataset: time as datetime64 to the microsecond where the date is known, else seconds."""
    name, columns, start, vehicle, notes = read
    values = {column: np.frombuffer(raw, dtype=np.float64).copy() for column, _, raw in columns}
    units = {column: unit(u) for column, u, _ in columns}
    seconds = values.pop("time_s")
    attrs: dict[str, Any] = {"name": name, "source": source, "flight_format": FORMAT, "Conventions": "CF-1.11", "featureType": "trajectory"}
    encoding: dict[str, Any] = {"_FillValue": None}
    if start is None:
        time: Any = seconds
        said = {"units": "s", "axis": "T", "long_name": "time since the start of the flight, whose date is not known"}
    else:
        microseconds = round(start * 1e6)
        time = ((np.rint(seconds * 1e6).astype(np.int64) + microseconds) * 1000).astype("datetime64[ns]")
        said = {"standard_name": "time", "axis": "T", "long_name": "time of measurement, UTC"}
        since = pd.Timestamp(microseconds // 1_000_000, unit="s")
        encoding |= {"units": f"seconds since {since}", "dtype": "float64", "calendar": "proleptic_gregorian"}
        attrs["start_unix_s"] = microseconds / 1e6
    if vehicle is not None:
        attrs["vehicle"] = vehicle
    if notes:
        attrs["comment"] = "; ".join(notes)
    variables = {}
    for column, numbers in values.items():
        standard, what = _CF.get(column, (None, column.replace("_", " ")))
        about = {"units": units[column], "standard_name": standard, "long_name": what, **_AXIS.get(column, {})}
        whole = numbers.astype(np.int32) if column == "segment" else numbers
        variables[column] = ("time", whole, {k: v for k, v in about.items() if v})
    coords: dict[str, Any] = {c: variables.pop(c) for c in ("segment", "latitude", "longitude", "depth") if c in variables}
    out = xr.Dataset(variables, coords={"time": ("time", time, said), **coords}, attrs=attrs)
    out["time"].encoding.update(encoding)
    return out


def placed(flight: xr.Dataset, source: xr.Dataset, name: str) -> xr.Dataset:
    """A flight without GPS fixes with the latitude and longitude that stood in each row of its source."""
    found = {c: _called(source, c) for c in ("latitude", "longitude")}
    if "latitude" in flight.variables or flight["time"].dtype.kind != "M" or not all(found.values()):
        return flight
    time = time_of(source, name)
    count = time.values.astype("datetime64[ns]").astype(np.int64) if time.dtype.kind == "M" else None
    for coordinate, variable in found.items():
        values = np.asarray(source[variable].values)
        if count is None or values.shape != count.shape or values.dtype.kind not in "iuf":
            return flight
        known = np.isfinite(values) & (count > np.iinfo(np.int64).min)
        if not known.any():
            return flight
        standard, _ = _CF[coordinate]
        about = {"units": f"degrees_{'north' if coordinate == 'latitude' else 'east'}", "standard_name": standard, **_AXIS[coordinate]}
        where = np.interp(flight["time"].values.astype(np.int64), count[known], values[known])
        flight = flight.assign_coords({coordinate: ("time", where, {**about, "long_name": f"{coordinate} as the source has it"})})
    return flight


def _called(source: xr.Dataset, coordinate: str) -> str:
    """The variable of a source that is a latitude or longitude of each row; empty where there is none."""
    short = {"latitude": ("latitude", "lat"), "longitude": ("longitude", "lon")}[coordinate]
    named = [str(v) for v in source.variables if str(v).split(" (")[0].lower() in short and source[v].ndim == 1]
    return named[0] if named else ""


def is_flight(columns: Sequence[Any]) -> bool:
    """Whether the names of columns are those of the flight format."""
    return "pressure_dbar" in columns


def time_of(flight: xr.Dataset, name: str) -> xr.DataArray:
    """The variable that is the time of a flight, decoded."""
    whole = flight.variables

    def is_time(v: str) -> bool:
        said = whole[v].attrs
        return str(v).split(" (")[0].lower() in ("time", "time_s") or said.get("standard_name") == "time" or said.get("axis") == "T" or whole[v].dtype.kind == "M"

    found = sorted((v for v in whole if whole[v].ndim == 1 and is_time(str(v))), key=lambda v: str(v).lower() != "time")
    if not found:
        raise GliderError(f"{name}: the Dataset has no time (it has: {', '.join(map(str, whole))}); call a coordinate `time`")
    time = flight[found[0]]
    if time.dtype.kind in "iuf" and " since " in str(time.attrs.get("units", "")):
        try:
            time = xr.decode_cf(time.to_dataset(name="time_")[["time_"]].reset_coords(drop=True))["time_"]
        except Exception as e:
            raise GliderError(f"{name}: time in \"{time.attrs['units']}\" cannot be decoded ({e}); decode it with xarray.decode_cf") from None
    if time.dtype.kind in "OUS":
        with suppress(ValueError, TypeError):
            written = pd.to_datetime(pd.Series(time.values), utc=True, format="ISO8601").dt.tz_localize(None)
            time = time.copy(data=written.to_numpy("datetime64[ns]"))
    if time.dtype.kind not in "iufMm":
        raise GliderError(f"{name}: time is of the type {time.dtype}; make it datetime64, or seconds")
    return time


def rows(flight: xr.Dataset, name: str) -> tuple[pd.DataFrame, float | None]:
    """A Dataset as a table of the flight format, and the Unix time at which its clock is zero, s."""
    time = time_of(flight, name)
    along = time.dims[0]
    start = flight.attrs.get("start_unix_s")
    if time.dtype.kind == "M":
        nanoseconds = time.values.astype("datetime64[ns]")
        if np.isnat(nanoseconds).any():
            raise GliderError(f"{name}: {int(np.isnat(nanoseconds).sum())} rows have no time (NaT); drop them with dropna('{along}')")
        count = nanoseconds.astype(np.int64)
        start = float(start) if start is not None else count[0] / 1e9 if count.size else 0.0
        seconds = (count - round(start * 1e6) * 1000) / 1e9
    elif time.dtype.kind == "m":
        seconds, start = time.values.astype("timedelta64[ns]").astype(np.int64) / 1e9, None
    else:
        seconds = time.values.astype(np.float64)
        if start is None and seconds.size and seconds[0] > 1e8:
            start = float(seconds[0])
            seconds = seconds - start
    columns = {"time_s": seconds}
    for column in map(str, flight.variables):
        v = flight.variables[column]
        if v.dims == (along,) and column not in (time.name, "time", "time_s", *COMPUTED) and v.dtype.kind in "iufb":
            columns[column] = np.asarray(v.values, dtype=np.float64)
    table = pd.DataFrame(columns)
    if "segment" in table and table["segment"].notna().all():
        table["segment"] = table["segment"].astype(np.int64)
    return table, start


def import_json(start: float | None) -> str:
    """What is stored with a flight whose date is known."""
    return json.dumps({"report": {} if start is None else {"start_unix_s": start}})
