"""The commands that ask a flight or a vehicle."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, Union

import numpy as np
import pandas as pd
import xarray as xr

from . import _errors
from ._answers import Answer, answer
from ._core import GliderError
from ._files import Files
from ._flight import unit
from ._history import History, history_file, learnt

if TYPE_CHECKING:
    from matplotlib.figure import Figure

StrPath = Union[str, "PathLike[str]"]
FlightLike = Union[StrPath, Sequence[StrPath], xr.Dataset, pd.DataFrame]
FlightsLike = Union[FlightLike, Sequence[FlightLike]]
VehicleLike = Union[StrPath, Mapping[str, Any]]


def read(flight: FlightLike) -> xr.Dataset:
    """Reads a flight: a flight directory, a csv file, a glider's own files or folder (Slocum, Seaglider, SeaExplorer, OG1, …), several files of
    one flight; or a Dataset or DataFrame of other names and units, such as pyglider's or an ERDDAP table.

    Returns a Dataset along ``time`` (datetime64 in UTC; where the date is not known, seconds since the start) with the columns of the flight
    format, NaN where there is no value, and CF attributes. ``attrs["vehicle"]`` is the vehicle file as far as the files state it (JSON),
    ``attrs["comment"]`` what was found, repaired and left out. `xarray.Dataset.to_netcdf` writes it so that `read` gives it back.
    """
    with Files() as files:
        return files.dataset(flight)


def vehicle(flight: FlightLike) -> dict[str, Any]:
    """The vehicle file of a flight as a dictionary, to be looked through and changed."""
    text = (flight if isinstance(flight, xr.Dataset) else read(flight)).attrs.get("vehicle")
    if not isinstance(text, str):
        raise GliderError("flight: its files do not say which vehicle flew it; name a vehicle file, or a built-in one: names('vehicles')")
    made: dict[str, Any] = json.loads(text)
    return made


def names(what: Literal["effects", "faults", "vehicles", "missions", "changes"]) -> pd.DataFrame:
    """What other functions take by name: ``"effects"``, ``"faults"``, ``"vehicles"``, ``"missions"``, ``"changes"``."""
    all_of = ("effects", "faults", "vehicles", "missions", "changes")
    if what not in all_of:
        raise GliderError(f"what: {what!r}; give one of {', '.join(all_of)}")
    with Files() as files:
        d, _ = files.run("list", what)
    return pd.DataFrame(d["items"])


def compare(flight: FlightLike, vehicle: VehicleLike | None = None) -> Answer:
    """Model against measurement, nothing fitted: how wrong, and where.

    One row a range of a variable that the error follows, best lead first. ``attrs``: ``rms`` and ``noise_floor`` of the vertical velocity, cm/s.
    """
    with Files() as files:
        d, _ = files.run("compare", "--flight", files.flight(flight), *files.vehicle(vehicle))
    rows = [{**{k: v for k, v in w.items() if k != "range"}, "low": w["range"][0], "high": w["range"][1]} for w in d["where"]]
    units = {"mean_residual_cm_s": "cm/s", "share_of_error": "1", "p_value": "1"}
    headline = f"Vertical velocity, measured against modelled: rms {d['rms_cm_s']} cm/s"
    return answer(rows, d, units, headline, rms=d["rms_cm_s"], noise_floor=d["noise_floor_cm_s"])


def _hypotheses(candidates: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One row an effect and parameter, and one for the hypothesis that nothing is missing."""
    rows = []
    for rank, c in enumerate(candidates, 1):
        of = {"rank": rank, "hypothesis": " + ".join(c["effects"]) or "nothing"}
        about = {k: c.get(k) for k in ("probability", "error_after", "error_after_heldout", "evidence")}
        none: dict[str, dict[str, Any]] = {"": {"value": None, "low": None, "high": None, "unit": ""}}
        for name, p in (c["parameters"] or none).items():
            effect, _, parameter = name.partition(".")
            numbers = {k: np.nan if p[k] is None else p[k] for k in ("value", "low", "high")}
            rows.append({**of, "effect": effect, "parameter": parameter, **numbers, "unit": unit(p["unit"]), **about})
    return rows


def diagnose(
    flight: FlightLike, vehicle: VehicleLike | None = None, *, depth: int = 2, quick: bool = False, history: History | StrPath | None = None
) -> Answer:
    """Which physical effect is missing: one row an effect and parameter of each hypothesis, the best hypothesis first.

    ``attrs``: ``verdict`` (adequate, explained, ambiguous, unexplained), ``answer``, ``equivalent`` and ``explanation``. ``quick`` asks one
    effect at a time; ``depth`` is the most effects that are sought at once, 2 or 3. ``history`` has earlier dives of the vehicle, by which the
    flight is judged (`calibrate` makes one).
    """
    depth = _errors.whole("depth", depth, 2, 3)
    if _errors.flag("quick", quick) and depth == 3:
        raise GliderError("quick: it asks one effect at a time, and depth=3 three; give one of them")
    how: list[Any] = ["--quick"] if quick else ["--depth", depth]
    with Files() as files:
        how += ["--history", history_file(files, history)] if history is not None else []
        d, _ = files.run("diagnose", "--flight", files.flight(flight), *files.vehicle(vehicle), *how)
    about = {k: d.get(k) for k in ("verdict", "answer", "equivalent", "explanation")}
    units = {"error_after": "cm/s", "error_after_heldout": "cm/s", "probability": "1"}
    return answer(_hypotheses(d["candidates"]), d, units, f"{d['verdict']}: {d['explanation']}", **about)


def _parameters(of: Mapping[str, Any]) -> list[dict[str, Any]]:
    rows = []
    for name, p in of.items():
        effect, _, parameter = name.partition(".")
        rows.append({"name": name, "effect": effect, "parameter": parameter, **p, "unit": unit(p["unit"])})
    return rows


def add(flight: FlightLike, effects: str | Sequence[str], vehicle: VehicleLike | None = None) -> tuple[dict[str, Any], Answer]:
    """Adds effects (names, or one expression such as ``"cd += k*abs(roll)*U"``) and refits calibration and effects together.

    Returns the new vehicle file as a dictionary, and its new parameters with 90 % intervals. ``attrs["better"]``: whether the error on segments kept
    out of the fit fell.
    """
    chosen = _errors.texts("effects", effects, "the name of an effect (names('effects')) or an expression")
    if not chosen:
        raise GliderError("effects: an empty list; give the name of an effect: names('effects')")
    with Files() as files:
        out = files.new("vehicle.json")
        d, positive = files.run("add", ",".join(chosen), "--flight", files.flight(flight), *files.vehicle(vehicle), "--out", out)
        new = json.loads(out.read_text())
    headline = f"Error {d['error_before']} cm/s as given, {d['error_recalibrated']} recalibrated, {d['error_after']} with {', '.join(d['effects'])}"
    return new, answer(_parameters(d["parameters"]), d, {}, headline, better=positive)


def calibrate(
    flights: FlightsLike, vehicle: VehicleLike | None = None, *, free: Sequence[str] = (), one_deployment: bool = False
) -> tuple[dict[str, Any], Answer]:
    """Several flights of one vehicle: its numbers, and the tolerance within which the next flight's are expected.

    ``free`` names numbers whose tolerance in the file is not to be believed; ``one_deployment`` says that trim and pitch zero are those of all
    flights and the next. Returns the calibrated vehicle file as a dictionary, and its numbers before and after. ``attrs["history"]`` is the
    `History` of the dives (None: fewer than three), by which `diagnose` judges the next flight.
    """
    named = _errors.texts("free", free, "the name of a number of the vehicle")
    how = ["--free", ",".join(named)] if named else []
    how += ["--one-deployment"] if _errors.flag("one_deployment", one_deployment) else []
    with Files() as files:
        out = files.new("vehicle.json", "vehicle")
        learnt_in = files.named(out.with_suffix(".history"), "history")
        options = [part for f in files.several(flights) for part in ("--flight", f)]
        d, positive = files.run("calibrate", *options, *files.vehicle(vehicle), *how, "--out", out)
        new = json.loads(out.read_text())
        history = learnt(learnt_in, new, d["history"])
    rows = [{**n, "value": n["after"], "unit": unit(n["unit"])} for n in d["numbers"]]
    return new, answer(rows, d, {}, f"{len(d['flights'])} flights", better=positive, history=history)


@dataclass
class Timeline:
    """A mission dive by dive."""

    dives: xr.Dataset
    """Levels relative to the vehicle file along ``dive``; ``NAME_low`` and ``NAME_high`` are the 90 % interval."""
    changes: Answer
    """What changed: kind, first dive that has it, size with its interval."""
    document: dict[str, Any]
    """All that ``glider timeline --json`` says."""

    def plot(self) -> Figure:
        """Levels with their intervals, and the changes where they begin."""
        import matplotlib.pyplot as plt

        shown = [n for n in map(str, self.dives) if f"{n}_low" in self.dives]
        figure, axes = plt.subplots(len(shown), sharex=True, figsize=(8, 1.7 * len(shown)), layout="constrained")
        for ax, name in zip(np.atleast_1d(axes), shown):
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

    def _repr_html_(self) -> str:
        return self.changes._repr_html_()


def timeline(flights: FlightsLike, vehicle: VehicleLike | None = None, *, dives_per_alarm: float = 1000.0) -> Timeline:
    """Drag, lift, trim, pitch zero, compressibility and pressure zero over a mission; what changed, and when.

    ``flights`` in the order in which they were flown; a folder stands for the flight directories in it. ``vehicle`` is best one that
    `calibrate` made; left out, it is the one of the first flight. An alarm is false once in ``dives_per_alarm`` dives.
    """
    alarm = _errors.number("dives_per_alarm", dives_per_alarm, 10, 1e9)
    with Files() as files:
        paths = files.mission(flights)
        judge = files.vehicle(vehicle) or files.vehicle_of(paths[0])
        d, _ = files.run("timeline", *paths, *judge, "--dives-per-alarm", alarm)
    return Timeline(_dives(d), _changes(d), d)


def _dives(d: Mapping[str, Any]) -> xr.Dataset:
    rows = d["dives"]

    def column(key: str) -> tuple[str, list[Any]]:
        return "dive", [np.nan if r[key] is None else r[key] for r in rows]

    data: dict[str, Any] = {}
    for name in rows[0]["levels"]:
        for part, suffix, words in (("value", "", ""), ("low", "_low", ", 90 % from"), ("high", "_high", ", 90 % to")):
            values = [r["levels"][name][part] for r in rows]
            about = {"units": unit(rows[0]["levels"][name]["unit"]), "long_name": f"{name.replace('_', ' ')} relative to the vehicle file{words}"}
            data[name + suffix] = ("dive", np.array(values, dtype=float), about)
    for key, of, words in (("day", "day", "days of the mission"), ("depth_m", "m", "depth of the dive"), ("rows", "1", "rows of the dive")):
        data[key] = (*column(key), {"units": of, "long_name": words})
    coords: dict[str, Any] = {"dive": column("dive"), "flight": column("flight"), "segment": column("segment")}
    if d.get("start_unix_s") is not None:
        days = np.array([r["day"] for r in rows], dtype=float) * 86_400e6 + d["start_unix_s"] * 1e6
        time = (np.rint(days).astype(np.int64) * 1000).astype("datetime64[ns]")
        coords["time"] = ("dive", time, {"standard_name": "time", "long_name": "time of the dive, UTC"})
    return xr.Dataset(data, coords=coords, attrs={"Conventions": "CF-1.11"})


def _changes(d: Mapping[str, Any]) -> Answer:
    lists = ("size", "equivalent", "moved")
    rows = [{**{k: v for k, v in c.items() if k not in lists}, **c["size"], "unit": unit(c["unit"])} for c in d["changes"]]
    columns = ["kind", "about", "number", "shape", "dive", "dive_low", "dive_high", "day", "value", "low", "high", "unit"]
    columns += ["per_day", "range_percent", "strength_sigma"]
    out = answer(rows, d, {}, f"{len(d['dives'])} dives: {', '.join(c['kind'] for c in d['changes']) or 'no change'}")
    whole = Answer(out.reindex(columns=columns))
    whole.attrs.update({**out.attrs, "units": {"day": "day", "range_percent": "%"}})
    return whole


def next_flight(flight: FlightLike, vehicle: VehicleLike | None = None) -> Answer:
    """The mission that would separate what this flight cannot: one row a dive and climb.

    ``attrs``: ``tied`` (the hypotheses), ``tells_apart``, and ``mission``, the text of a mission file (None where no mission separates them).
    """
    with Files() as files:
        out = files.new("mission.toml")
        d, _ = files.run("next-flight", "--flight", files.flight(flight), *files.vehicle(vehicle), "--out", out)
        mission = out.read_text() if out.exists() else None
    d["mission"] = mission
    rows = [{**leg, "expected_chi2": chi2} for leg, chi2 in zip(d["legs"], d.get("expected_chi2", []))]
    units = {"pitch_deg": "degree", "ballast_cc": "cm^3", "expected_chi2": "1"}
    tied = " / ".join(" with ".join(t) for t in d["tied"]) or "no two hypotheses"
    return answer(rows, d, units, f"To tell apart: {tied}", tied=d["tied"], mission=mission, tells_apart=d["tells_apart"])


def forecast(
    flights: FlightsLike, vehicle: VehicleLike | None = None, *, mission: StrPath | None = None, surfacings: int = 3
) -> Answer:
    """Where and when a vehicle comes up next: one row a surfacing, with its 90 % ellipse.

    ``flights`` are the logs of one mission, in order; ``mission`` names the one that is flown next (left out, the last dive is flown again).
    ``attrs["coverage"]`` says on how many earlier surfacings the size of the ellipse rests.
    """
    count = _errors.whole("surfacings", surfacings, 1, 50)
    planned = [] if mission is None else ["--mission", _errors.path("mission", mission)]
    with Files() as files:
        paths = files.mission(flights)
        judge = files.vehicle(vehicle) or files.vehicle_of(paths[0])
        d, _ = files.run("forecast", *[part for p in paths for part in ("--flight", p)], *judge, *planned, "--surfacings", count)
    rows = [{**{k: v for k, v in s.items() if k != "ellipse"}, **s["ellipse"]} for s in d["surfacings"]]
    units = {"time_s": "s", "hours_ahead": "h", "east_m": "m", "north_m": "m", "semi_major_m": "m", "semi_minor_m": "m", "azimuth_deg": "degree"}
    return answer(rows, d, units, d["coverage"]["says"], coverage=d["coverage"])


def report(flight: FlightLike, out: StrPath, vehicle: VehicleLike | None = None) -> str:
    """Writes the offline page of a flight (diagnosis, errors, figures in one HTML file); returns its path."""
    page = _errors.path("out", out)
    if not page.lower().endswith((".html", ".htm")):
        raise GliderError(f"out: {page}: a page is HTML; name a file that ends in .html")
    with Files() as files:
        files.run("--force", "report", "--flight", files.flight(flight), *files.vehicle(vehicle), "--out", page)
    return page


def polar(vehicle: VehicleLike, *, to: float = 25.0, step: float = 1.0, effects: Mapping[str, float] | None = None) -> xr.Dataset:
    """Lift and drag coefficients and their ratio along the angle of attack, degrees; ``effects`` are put on top by name and size."""
    if vehicle is None:
        _errors.wrong_type("vehicle", vehicle, "the path of a vehicle file, the name of a built-in vehicle, or a dictionary")
    if not isinstance(effects or {}, Mapping):
        _errors.wrong_type("effects", effects, "a dictionary of sizes by the name of the effect")
    sizes = {name: _errors.number(f"effects[{name!r}]", size, -1e9, 1e9) for name, size in (effects or {}).items()}
    more = [part for name, size in sizes.items() for part in ("--effect", f"{name}={size}")]
    reach = _errors.number("to", to, 1, 90, "degrees")
    every = _errors.number("step", step, 0.01, reach, "degrees")
    with Files() as files:
        d, _ = files.run("polar", *files.vehicle(vehicle), "--to", reach, "--step", every, *more)
    p = d["polars"][0]
    what = {"cl": "lift coefficient", "cd": "drag coefficient", "l_over_d": "lift over drag", "wing_lift_share": "share of the wings in the lift"}
    data = {name: ("alpha", np.array(p[name], dtype=float), {"units": "1", "long_name": words}) for name, words in what.items()}
    out = xr.Dataset(data, coords={"alpha": ("alpha", p["alpha_deg"], {"units": "degree", "long_name": "angle of attack"})})
    out.attrs.update(vehicle=p["vehicle"], reference_area_m2=p["reference_area_m2"], alpha_valid_deg=p["alpha_valid_deg"], best=p["best"])
    return out


