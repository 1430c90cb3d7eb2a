"""Every function of the package against a simulated flight, and against what the program says of the same files."""

import json
import threading
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import glider_workbench as gw
from glider_workbench import _core


def test_read_gives_the_columns_of_the_log_with_units(trial: Path) -> None:
    flight = gw.read(trial)
    log = pd.read_csv(trial / "flight.csv", comment="#")
    assert flight.sizes["time"] == len(log) and flight.attrs["name"] == "flight"
    np.testing.assert_allclose(flight["pressure_dbar"], log["pressure_dbar"], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(flight["segment"], log["segment"])
    assert flight["pressure_dbar"].attrs["units"] == "dbar" and flight["m_pitch_rad"].attrs["units"] == "rad"


def test_a_dataset_a_frame_and_a_path_are_the_same_flight(trial: Path) -> None:
    vehicle = json.loads((trial / "vehicle.json").read_text())
    flight = gw.read(trial)
    frame = flight.to_dataframe().reset_index().rename(columns={"time": "time_s"})
    of_path = gw.compare(trial)
    assert of_path.attrs["rms"] > 0 and of_path.attrs["units"]["mean_residual_cm_s"] == "cm/s"
    for same in (flight, frame):
        other = gw.compare(same, vehicle)
        assert other.attrs["rms"] == pytest.approx(of_path.attrs["rms"], abs=1e-5)
    # What is changed in Python counts.
    changed = flight.assign(pressure_dbar=1.1 * flight["pressure_dbar"])
    assert gw.compare(changed, vehicle).attrs["rms"] > 1.2 * of_path.attrs["rms"]


def test_functions_say_what_the_commands_say(trial: Path) -> None:
    text, positive = _core.command(["compare", "--flight", str(trial)])
    assert positive and json.loads(text) == gw.compare(trial).attrs["document"]


def test_diagnose_add_and_next_flight(trial: Path) -> None:
    found = gw.diagnose(trial, quick=True)
    assert found.attrs["verdict"] in {"adequate", "explained", "ambiguous", "unexplained"} and "probability" in found
    vehicle, parameters = gw.add(trial, ["drag_level_error"])
    assert "drag_level_error" in vehicle["effects"] and parameters["name"].iloc[0].startswith("drag_level_error")
    assert parameters["low"].iloc[0] <= parameters["value"].iloc[0] <= parameters["high"].iloc[0]
    legs = gw.next_flight(trial)
    assert isinstance(legs.attrs["tells_apart"], bool) and (legs.attrs["mission"] is None or legs.attrs["tells_apart"])


def test_calibrate_narrows_and_the_timeline_follows(trial: Path, known: dict, archive: Path) -> None:
    given = json.loads((trial / "vehicle.json").read_text())
    assert known["tolerance_1sigma"] != given.get("tolerance_1sigma") and known["provenance"]
    line = gw.timeline([archive / "may"], known)
    assert line.dives.sizes["dive"] == 16 and line.dives["drag"].attrs["units"] == "%"
    assert bool((line.dives["drag_low"] <= line.dives["drag"]).all()) and list(line.changes.columns[:1]) in ([], ["kind"])
    figure = line.plot()
    assert len(figure.axes) == 6


def test_forecast_has_a_row_a_surfacing_with_its_ellipse(trial: Path) -> None:
    ahead = gw.forecast(trial, surfacings=2)
    assert list(ahead["surfacing"]) == [1, 2] and bool((ahead["semi_major_m"] >= ahead["semi_minor_m"]).all())
    assert ahead.attrs["coverage"]["asked"] == 0.9 and bool(ahead["time_s"].diff().dropna().gt(0).all())


def test_polar_is_lift_over_drag(trial: Path) -> None:
    curve = gw.polar(trial / "vehicle.json", to=10.0, step=0.5)
    assert curve.sizes["alpha"] == 21 and curve["alpha"].attrs["units"] == "degree"
    xr.testing.assert_allclose(curve["l_over_d"], curve["cl"] / curve["cd"], atol=1e-9)
    assert float(gw.polar(trial / "vehicle.json", effects={"drag_level_error": 0.5})["l_over_d"].max()) < float(curve["l_over_d"].max())


def test_bad_input_names_the_file_and_the_remedy(tmp_path: Path, trial: Path) -> None:
    with pytest.raises(gw.GliderError, match="nothing: no such"):
        gw.compare(tmp_path / "nothing")
    with pytest.raises(gw.GliderError, match="vehicle"):
        gw.compare(gw.read(trial).drop_attrs())
    with pytest.raises(ValueError, match="drg"):
        gw.add(trial, "drg")
    bad = tmp_path / "flight.csv"
    bad.write_text("time_s,pressure_dbar\n0,1\nx,2\n")
    with pytest.raises(gw.GliderError, match="flight.csv"):
        gw.read(bad)


def test_other_threads_run_while_rust_works(trial: Path) -> None:
    beats, over = [], threading.Event()

    def beat() -> None:
        while not over.is_set():
            beats.append(time.perf_counter())
            time.sleep(0.01)

    thread = threading.Thread(target=beat)
    thread.start()
    begun = time.perf_counter()
    gw.diagnose(trial, quick=True)
    took = time.perf_counter() - begun
    over.set()
    thread.join()
    during = sum(begun < b < begun + took for b in beats)
    # A hundred a second were asked for; with the lock held there would be one or two.
    assert during > 10 * took, f"{during} beats in {took:.1f} s"
