"""Underwater gliders: compare, diagnose, calibrate and follow flights, one or a whole fleet.

Every function runs the command of the same name of the program ``glider``, in this process and without the interpreter's lock. Units stand
in ``attrs``: ``attrs["units"]`` of each variable of a Dataset, and a dictionary ``attrs["units"]`` (column: unit) of a DataFrame. What a command
says besides its table is in ``attrs["document"]``, the document that ``glider … --json`` prints (docs/json.md).

A **flight** is a path (flight directory, csv, or a glider's own files), several paths of one flight's files, or what `read` returns,
changed or not. A **vehicle** is the path of a vehicle file or its content as a dictionary; left out, it is the file beside the flight.

>>> import glider_workbench as gw
>>> flight = gw.read("trial_dir")
>>> gw.diagnose("trial_dir").attrs["verdict"]
'explained'
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import pandas as pd
import xarray as xr

from . import _core
from ._core import GliderError, __version__
from ._files import Files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

StrPath = Union[str, "PathLike[str]"]
FlightLike = Union[StrPath, Sequence[StrPath], xr.Dataset, pd.DataFrame]
VehicleLike = Union[StrPath, Mapping[str, Any]]

__all__ = [
    "Faults", "Fleet", "FlightLike", "GliderError", "Timeline", "VehicleLike", "__version__", "add", "calibrate", "compare", "diagnose", "faults",
    "fleet", "merge", "next_flight", "polar", "read", "table", "timeline",
]

_core.identify(_core.__file__)  # type: ignore[attr-defined]


def _run(*arguments: Any) -> tuple[dict[str, Any], bool]:
    text, positive = _core.command([str(a) for a in arguments])
    return json.loads(text), positive


def _frame(rows: Sequence[Mapping[str, Any]], document: Mapping[str, Any], units: Mapping[str, str], **about: Any) -> pd.DataFrame:
    out = pd.DataFrame(list(rows))
    out.attrs.update(units={k: u for k, u in units.items() if k in out.columns}, document=dict(document), **about)
    return out


def read(path: StrPath | Sequence[StrPath]) -> xr.Dataset:
    """Reads a flight: a flight directory, a csv file, or a glider's own files (Slocum, Seaglider, SeaExplorer, OG1, …).

    Returns a Dataset along ``time`` (s since the first row) with the columns of the flight format, NaN where there is no value.
    """
    files = [path] if isinstance(path, (str, Path)) or hasattr(path, "__fspath__") else list(path)  # type: ignore[arg-type]
    name, columns = _core.read([fspath(f) for f in files])
    data = {column: ("time", np.frombuffer(raw, dtype=np.float64).copy(), {"units": unit}) for column, unit, raw in columns}
    time = data.pop("time_s")
    out = xr.Dataset({k: v for k, v in data.items() if k != "segment"}, coords={"time": ("time", time[1], {"units": "s"})})
    out = out.assign_coords(segment=("time", data["segment"][1].astype(np.int32)))
    out.attrs.update(name=name, source=", ".join(fspath(f) for f in files))
    return out


def compare(flight: FlightLike, vehicle: VehicleLike | None = None) -> pd.DataFrame:
    """Model against measurement, nothing fitted: how wrong, and where.

    One row a range of a variable that the error follows, best lead first. ``attrs``: ``rms`` and ``noise_floor`` of the vertical velocity, cm/s.
    """
    with Files() as files:
        d, _ = _run("compare", "--flight", files.flight(flight), *files.vehicle(vehicle))
    rows = [{**w, "low": w["range"][0], "high": w["range"][1]} for w in d["where"]]
    for row in rows:
        row.pop("range")
    units = {"mean_residual_cm_s": "cm/s", "share_of_error": "1", "p_value": "1"}
    return _frame(rows, d, units, rms=d["rms_cm_s"], noise_floor=d["noise_floor_cm_s"])


def diagnose(flight: FlightLike, vehicle: VehicleLike | None = None, *, depth: int = 2, quick: bool = False) -> pd.DataFrame:
    """Which physical effect is missing: one row a hypothesis, best first.

    ``attrs``: ``verdict`` (adequate, explained, ambiguous, unexplained), ``answer``, ``equivalent`` and ``explanation``. ``quick`` asks one
    effect at a time; ``depth`` is the most effects that are sought at once, 2 or 3.
    """
    how = ["--quick"] if quick else ["--depth", depth]
    with Files() as files:
        d, _ = _run("diagnose", "--flight", files.flight(flight), *files.vehicle(vehicle), *how)
    keys = ["verdict", "answer", "equivalent", "explanation"]
    units = {"error_after": "cm/s", "error_after_heldout": "cm/s", "probability": "1"}
    return _frame(d["candidates"], d, units, **{k: d.get(k) for k in keys})


def add(flight: FlightLike, effects: str | Sequence[str], vehicle: VehicleLike | None = None) -> tuple[dict[str, Any], pd.DataFrame]:
    """Adds effects (names, or one expression such as ``"cd += k*abs(roll)*U"``) and refits calibration and effects together.

    Returns the new vehicle file as a dictionary, and its new parameters with 90 % intervals. ``attrs["better"]``: whether the error on segments kept
    out of the fit fell.
    """
    names = effects if isinstance(effects, str) else ",".join(effects)
    with Files() as files:
        out = files.new("vehicle.json")
        d, positive = _run("add", names, "--flight", files.flight(flight), *files.vehicle(vehicle), "--out", out)
        new = json.loads(out.read_text())
    rows = [{"name": name, **p} for name, p in d["parameters"].items()]
    return new, _frame(rows, d, {}, better=positive)


def calibrate(
    flights: FlightLike | Sequence[FlightLike], vehicle: VehicleLike | None = None, *, free: Sequence[str] = (), one_deployment: bool = False
) -> tuple[dict[str, Any], pd.DataFrame]:
    """Several flights of one vehicle: its numbers, and the tolerance within which the next flight's are expected.

    ``free`` names numbers whose tolerance in the file is not to be believed; ``one_deployment`` says that trim and pitch zero are those of all
    flights and the next. Returns the calibrated vehicle file as a dictionary, and its numbers before and after.
    """
    several = list(flights) if isinstance(flights, (list, tuple)) else [flights]
    how = ["--free", ",".join(free)] if free else []
    how += ["--one-deployment"] if one_deployment else []
    with Files() as files:
        out = files.new("vehicle.json")
        named = [part for f in several for part in ("--flight", files.flight(f))]
        d, positive = _run("calibrate", *named, *files.vehicle(vehicle), *how, "--out", out)
        new = json.loads(out.read_text())
    return new, _frame(d["numbers"], d, {}, better=positive)


@dataclass
class Timeline:
    """A mission dive by dive."""

    dives: xr.Dataset
    """Levels relative to the vehicle file along ``dive``; ``NAME_low`` and ``NAME_high`` are the 90 % interval."""
    changes: pd.DataFrame
    """What changed: kind, first dive that has it, size with its interval."""
    document: dict[str, Any]
    """All that ``glider timeline --json`` says."""

    def plot(self) -> Figure:
        """Levels with their intervals, and the changes where they begin."""
        import matplotlib.pyplot as plt

        names = [n for n in self.dives if f"{n}_low" in self.dives]
        figure, axes = plt.subplots(len(names), sharex=True, figsize=(8, 1.7 * len(names)), layout="constrained")
        for ax, name in zip(np.atleast_1d(axes), names):
            x = self.dives["dive"].values
            ax.fill_between(x, self.dives[f"{name}_low"], self.dives[f"{name}_high"], alpha=0.3, linewidth=0)
            ax.plot(x, self.dives[name], marker=".")
            ax.set_ylabel(f"{name}\n{self.dives[name].attrs['units']}".replace("_", " "))
            for change in self.document["changes"]:
                if change["number"] == name:
                    ax.axvline(change["dive"] - 0.5, color="C3")
                    ax.annotate(change["kind"], (change["dive"], 0.9), xycoords=("data", "axes fraction"), color="C3")
        np.atleast_1d(axes)[-1].set_xlabel("dive")
        return figure


def timeline(flights: FlightLike | Sequence[FlightLike], vehicle: VehicleLike, *, dives_per_alarm: float = 1000.0) -> Timeline:
    """Drag, lift, trim, pitch zero, compressibility and pressure zero over a mission; what changed, and when.

    ``flights`` in the order in which they were flown; a folder stands for the flight directories in it. ``vehicle`` is best one that
    `calibrate` made. An alarm is false once in ``dives_per_alarm`` dives.
    """
    several = list(flights) if isinstance(flights, (list, tuple)) else [flights]
    with Files() as files:
        paths = [files.mission(f) for f in several]
        d, _ = _run("timeline", *paths, *files.vehicle(vehicle), "--dives-per-alarm", dives_per_alarm)
    rows = d["dives"]
    column = lambda key: ("dive", [np.nan if r[key] is None else r[key] for r in rows])  # noqa: E731
    data: dict[str, Any] = {}
    for name in rows[0]["levels"]:
        for part, suffix in (("value", ""), ("low", "_low"), ("high", "_high")):
            values = [r["levels"][name][part] for r in rows]
            data[name + suffix] = ("dive", np.array(values, dtype=float), {"units": rows[0]["levels"][name]["unit"]})
    for key, unit in (("day", "day"), ("depth_m", "m"), ("rows", "1")):
        data[key] = (*column(key), {"units": unit})
    coords = {"dive": column("dive"), "flight": column("flight"), "segment": column("segment")}
    changes = [{**c, "low": c["size"]["low"], "high": c["size"]["high"], "size": c["size"]["value"]} for c in d["changes"]]
    return Timeline(xr.Dataset(data, coords=coords), _frame(changes, d, {"day": "day", "range_percent": "%"}), d)


def next_flight(flight: FlightLike, vehicle: VehicleLike | None = None) -> pd.DataFrame:
    """The mission that would tell apart what this flight cannot: one row a dive and climb.

    ``attrs``: ``tied`` (the hypotheses), ``tells_apart``, and ``mission``, the text of a mission file (None where nothing can be told apart).
    """
    with Files() as files:
        d, _ = _run("next-flight", "--flight", files.flight(flight), *files.vehicle(vehicle))
    rows = [{**leg, "expected_chi2": chi2} for leg, chi2 in zip(d["legs"], d["expected_chi2"])]
    units = {"pitch_deg": "deg", "ballast_cc": "cm3", "expected_chi2": "1"}
    return _frame(rows, d, units, tied=d["tied"], mission=d["mission"], tells_apart=d["tells_apart"])


def polar(vehicle: VehicleLike, *, to: float = 25.0, step: float = 1.0, effects: Mapping[str, float] | None = None) -> xr.Dataset:
    """Lift and drag coefficients and their ratio along the angle of attack, degrees; ``effects`` are put on top by name and size."""
    more = [part for name, size in (effects or {}).items() for part in ("--effect", f"{name}={size}")]
    with Files() as files:
        d, _ = _run("polar", *files.vehicle(vehicle), "--to", to, "--step", step, *more)
    p = d["polars"][0]
    data = {name: ("alpha", np.array(p[name], dtype=float), {"units": "1"}) for name in ("cl", "cd", "l_over_d", "wing_lift_share")}
    out = xr.Dataset(data, coords={"alpha": ("alpha", p["alpha_deg"], {"units": "deg"})})
    out.attrs.update(vehicle=p["vehicle"], reference_area_m2=p["reference_area_m2"], alpha_valid_deg=p["alpha_valid_deg"], best=p["best"])
    return out


from ._faults import Faults, faults  # noqa: E402
from ._fleet import Fleet, fleet, merge, table  # noqa: E402
