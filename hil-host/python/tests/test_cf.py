"""Flights as others know them: the CF conventions, units, files, times of every kind."""

from pathlib import Path

import cf_xarray  # noqa: F401
import cf_xarray.units  # noqa: F401
import numpy as np
import pandas as pd
import pint_xarray  # noqa: F401
import pytest
import xarray as xr

import glider_workbench as gw


def test_axes_standard_names_and_units_are_read_by_cf_xarray_and_pint(dives: Path) -> None:
    flight = gw.read(dives)
    assert flight.cf.axes == {"X": ["longitude"], "Y": ["latitude"], "Z": ["depth"], "T": ["time"]}
    assert {"sea_water_temperature", "sea_water_density", "platform_pitch_fore_up", "depth", "latitude", "time"} <= set(flight.cf.standard_names)
    for name, variable in flight.variables.items():
        assert variable.attrs["long_name"], name
    known = {k: v.attrs["units"] for k, v in flight.data_vars.items() if "units" in v.attrs}
    assert known["sci_density_kg_m3"] == "kg/m^3" and known["m_ballast_pumped_cc"] == "cm^3"
    quantified = flight[list(known)].reset_coords(drop=True).pint.quantify()
    ballast = quantified["m_ballast_pumped_cc"].pint.to("m^3").pint.dequantify()
    np.testing.assert_allclose(ballast, 1e-6 * flight["m_ballast_pumped_cc"], rtol=1e-12)


def test_the_epoch_and_the_place_are_those_of_the_files(dives: Path) -> None:
    flight = gw.read(dives)
    assert flight["time"].dtype == "datetime64[ns]" and bool((np.diff(flight["time"]) > np.timedelta64(0)).all())
    first = sorted(dives.glob("p*.nc"))[0]
    with xr.open_dataset(first, decode_timedelta=False) as dive:
        start, places = dive["log_gps_time"].values, (dive["log_gps_lat"].values, dive["log_gps_lon"].values)
    assert abs(flight["time"].values[0] - start[1]) < np.timedelta64(20, "m")
    assert abs(float(flight["latitude"][0]) - places[0][1]) < 0.05 and abs(float(flight["longitude"][0]) - places[1][1]) < 0.05
    assert flight.attrs["start_unix_s"] == pytest.approx(flight["time"].values[0].astype(np.int64) / 1e9, abs=1.0)
    depth = flight["depth"].values / flight["pressure_dbar"].values
    assert 0.98 < np.nanmedian(depth) < 1.0 and float(flight["depth"].max()) > 100


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_a_flight_survives_its_file(dives: Path, trial: Path, tmp_path: Path, engine: str) -> None:
    for name, files in (("dated", dives), ("undated", trial)):
        flight = gw.read(files)
        flight.to_netcdf(tmp_path / f"{name}.nc", engine=engine)
        again = gw.read(tmp_path / f"{name}.nc")
        xr.testing.assert_allclose(again, flight, rtol=1e-9)
        assert np.array_equal(again["time"], flight["time"]) and set(again.variables) == set(flight.variables)
        assert again.attrs.get("start_unix_s") == flight.attrs.get("start_unix_s")
        assert gw.vehicle(again) == gw.vehicle(flight)
        with xr.open_dataset(tmp_path / f"{name}.nc", engine=engine) as opened:
            assert gw.compare(opened).attrs["rms"] == pytest.approx(gw.compare(flight).attrs["rms"], abs=1e-6)


def test_what_was_changed_survives_the_file_without_its_attributes(trial: Path, tmp_path: Path) -> None:
    flight = gw.read(trial)
    changed = flight.assign(m_pitch_rad=xr.DataArray(flight["m_pitch_rad"].values + 0.01, dims="time"), mine=flight["m_pitch_rad"] ** 2)
    changed.to_netcdf(tmp_path / "changed.nc")
    again = gw.read(tmp_path / "changed.nc")
    np.testing.assert_allclose(again["m_pitch_rad"], changed["m_pitch_rad"], rtol=1e-9)
    np.testing.assert_allclose(again["mine"], changed["mine"], rtol=1e-9)


def test_times_of_every_kind_are_the_same_flight(dives: Path) -> None:
    flight = gw.read(dives)
    rms = gw.compare(flight).attrs["rms"]
    seconds = (flight["time"].values - flight["time"].values[0]) / np.timedelta64(1, "s")
    since = f"days since {pd.Timestamp(flight['time'].values[0])}"
    times = {
        "datetime": flight["time"],
        "float": ("time", seconds, {"units": "s"}),
        "unix": ("time", seconds + flight.attrs["start_unix_s"]),
        "timedelta": ("time", flight["time"].values - flight["time"].values[0]),
        "encoded": ("time", seconds / 86_400, {"units": since, "calendar": "standard"}),
    }
    for kind, time in times.items():
        same = flight.assign_coords(time=time)
        if kind in ("float", "unix", "timedelta"):
            same.attrs.pop("start_unix_s")
        assert gw.compare(same).attrs["rms"] == pytest.approx(rms, abs=2e-3), kind
    frame = flight.to_dataframe()
    assert gw.compare(frame, gw.vehicle(flight)).attrs["rms"] == pytest.approx(rms, abs=2e-3)


def test_the_accessor_asks_what_the_functions_ask(trial: Path) -> None:
    flight = gw.read(trial)
    assert flight.glider.compare().attrs["document"]["rms_cm_s"] == gw.compare(flight).attrs["rms"]
    assert flight.glider.vehicle == gw.vehicle(trial)
    vehicle, _ = flight.glider.add("drag_level_error")
    assert "drag_level_error" in vehicle["effects"]
    assert flight.glider.timeline().dives.sizes["dive"] == 8
