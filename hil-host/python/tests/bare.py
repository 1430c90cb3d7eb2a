"""What has to work where nothing but the wheel and what it needs is installed; run with a folder of files of flights."""

import sys
import tempfile
from pathlib import Path

import numpy as np
import xarray as xr

import glider_workbench as gw

formats = Path(sys.argv[1])
flight = gw.read(formats / "seaglider_nc")
assert flight["time"].dtype == "datetime64[ns]" and {"latitude", "longitude", "depth"} <= set(flight.coords)
with tempfile.TemporaryDirectory() as folder:
    flight.to_netcdf(Path(folder) / "flight.nc")
    again = gw.read(Path(folder) / "flight.nc")
    with xr.open_dataset(Path(folder) / "flight.nc") as opened:
        assert np.array_equal(gw.read(opened)["time"], flight["time"])
xr.testing.assert_allclose(again, flight)
assert np.array_equal(again["time"], flight["time"])
vehicle = formats / "seaglider_nc/vehicle.json"
rms = flight.glider.compare(vehicle).attrs["rms"]
assert abs(gw.compare(flight.to_dataframe(), vehicle).attrs["rms"] - rms) < 1e-3
frame = gw.diagnose(flight, vehicle, quick=True)
assert list(frame["rank"])[0] == 1 and "<svg" in frame._repr_html_()
assert gw.timeline(flight, vehicle).dives.sizes["dive"] >= 1
try:
    gw.read("nowhere")
except FileNotFoundError as e:
    assert "flight: nowhere" in str(e)
else:
    raise AssertionError("nowhere is no flight")
print("works", sys.version.split()[0], np.__version__, xr.__version__)
