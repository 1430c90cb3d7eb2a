"""A dive's question to this program and to gliderflight, on the same simulated dives in one run.

Missions of up to eight dives are flown by `glider fly`, each with a drag and a trim of its own that no tool is given. Then each is asked of

  glider timeline     six numbers a dive (drag, lift, trim, pitch zero, compressibility, pressure zero), with 90 % intervals
  glider fleet        the same six and every effect of the catalogue that the vertical motion shows, with errors of noise, file and model
  gliderflight        mass and Cd0 by Nelder-Mead on the depth rate: steady-state model, and on request the dynamic one; no intervals

gliderflight (Merckelbach; MIT) is given all else that the vehicle file says: lift, drag due to lift, hull volume, compressibility, thermal
expansion (added to the ballast reading), added mass. Rows above 10 dbar are masked, for the steady model also those within 60 s of a moving
pump. Everything runs on one core. Seconds are CPU time: of `glider` with its start and reading of the log, divided by the dives; of
gliderflight from data in memory to the answer, dive by dive. Memory is the most that a process had, Python and its modules with it.
"""

import argparse
import csv
import importlib.util
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

PEER = "gliderflight==1.2.1"
EXAMPLE = "example:\n  python hil-host/python/examples/peers.py --glider target/release/glider --dives 40"
# The legs of the mission `sweep`: pitch in degrees (none: best glide), drive in cm3, heading in degrees.
LEGS = [(None, 230, 0), (26, 150, 90), (35, 200, 180), (22, 125, 270), (None, 200, 45), (24, 135, 200), (18, 180, 120), (30, 230, 310)]
# What is hidden, mission by mission: drag as a share of what the vehicle file says, trim in cm3.
HIDDEN = [(0.0, 0.0), (0.10, 10.0), (0.20, -10.0), (0.05, 5.0), (0.15, -5.0)]
CHANNELS = ["time_s", "pressure_dbar", "m_pitch_rad", "m_ballast_pumped_cc", "sci_density_kg_m3", "sci_water_temp_degC"]


def one_core() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def cpu_seconds() -> float:
    """Of this process and of those that it started and that ended: the dynamic model is solved in processes of its own."""
    return sum(r.ru_utime + r.ru_stime for r in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))


def run(command: list[str]) -> tuple[str, float, float]:
    """What a program prints, its CPU seconds, and the most memory that it had, MiB."""
    threads = dict.fromkeys(["RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"], "1")
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = subprocess.Popen(command, stdout=out, stderr=err, env=os.environ | threads)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        # 1 is a negative result: a change or an effect is named.
        if process.returncode not in (0, 1):
            sys.exit(f"peers: {' '.join(command)}: exit code {process.returncode}\n{err.read()}")
        return out.read(), used.ru_utime + used.ru_stime, used.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def fly(glider: str, folder: Path, number: int, dives: int) -> Path:
    """A mission with its hidden drag and trim; gives the flight."""
    drag, trim = HIDDEN[number % len(HIDDEN)]
    truth = "[ocean]\nbackground_rms_m_s = 0.002\n"
    for kind, value in (("drag_level_error", drag), ("ballast_offset", trim)):
        truth += f'[[effects]]\nkind = "{kind}"\nvalue = {value}\n' if value else ""
    mission = 'wings = "standard"\nmax_duration_h = 48\nsurface_every = 1\n'
    for pitch, drive, heading in LEGS[:dives]:
        goal = 'goal = "best-glide"' if pitch is None else f'goal = "fixed-pitch"\npitch_deg = {pitch}'
        mission += f"[[leg]]\ndives = 1\ndepth_min_m = 3\ndepth_max_m = 180\n{goal}\nballast_cc = {drive}\nheading_deg = {heading}\n"
    base = folder / f"mission{number}"
    base.mkdir(parents=True)
    (base / "truth.toml").write_text(truth)
    (base / "mission.toml").write_text(mission)
    files = ["--mission", str(base / "mission.toml"), "--truth", str(base / "truth.toml")]
    run([glider, "fly", *files, "--seed", str(100 + number), "--log", str(base / "flight")])
    return base / "flight"


def timeline(glider: str, flight: Path) -> dict[str, Any]:
    said, seconds, memory = run([glider, "timeline", str(flight), "--vehicle", str(flight / "vehicle.json"), "--json"])
    document = json.loads(said)
    dives = document["dives"]
    # A dive's own interval is beside the others of its mission; against the file, the mission's start counts.
    intervals = {name: document["start"][name] for name in ("drag", "trim")}
    answers = [{"drag": d["levels"]["drag"]["value"], "trim": d["levels"]["trim"]["value"], "intervals": intervals} for d in dives]
    return {"seconds": [seconds / len(dives)] * len(dives), "memory": memory, "answers": answers}


def fleet(glider: str, flight: Path) -> dict[str, Any]:
    said, seconds, memory = run([glider, "fleet", str(flight), "--jobs", "1", "--out", str(flight.parent / "fleet.parquet"), "--json"])
    document = json.loads(said)
    return {
        "seconds": [seconds / document["dives"]] * document["dives"],
        "memory": memory,
        "answers": [],
        "numbers": len(document["numbers"]),
    }


def peer(kind: str, flight: Path, dives: int) -> dict[str, Any]:
    """gliderflight in a process of its own: this program with --worker."""
    said, _, memory = run([sys.executable, __file__, "--worker", kind, str(flight), str(dives)])
    answers = json.loads(said.strip().splitlines()[-1])
    return {"seconds": [a["seconds"] for a in answers], "memory": memory, "answers": answers}


def worker(kind: str, flight: Path, dives: int) -> list[dict[str, float]]:
    import gliderflight
    import numpy as np

    vehicle = json.loads((flight / "vehicle.json").read_text())
    hydro, area = vehicle["hydro"], vehicle["hydro"]["reference_area_m2"]
    wing = hydro["wing_lift_slope_per_rad"] * vehicle["wing"]["area_m2"] / area
    hull = hydro["hull_lift_slope_per_rad"] * hydro["hull_area_m2"] / area
    with (flight / "flight.csv").open() as file:
        rows = list(csv.DictReader(file))
    segment = np.array([int(r["segment"]) for r in rows])
    data = {name: np.array([float(r[name] or "nan") for r in rows]) for name in CHANNELS}
    answers = []
    for number in list(dict.fromkeys(segment))[:dives]:
        of = {name: values[segment == number] for name, values in data.items()}
        for values in of.values():
            gaps = ~np.isfinite(values)
            values[gaps] = np.interp(np.flatnonzero(gaps), np.flatnonzero(~gaps), values[~gaps])
        t, ballast, density = of["time_s"], of["m_ballast_pumped_cc"], of["sci_density_kg_m3"]
        began = cpu_seconds()
        rho = float(density.mean())
        if kind == "steady":
            model = gliderflight.SteadyStateCalibrate(rho0=rho)
        else:
            model = gliderflight.DynamicCalibrate(rho0=rho, k1=hydro["added_mass_surge"], k2=hydro["added_mass_heave"], max_CPUs=1)
        model.define(
            S=area,
            # Its lift is linear: the slope at 0.05 rad.
            aw=wing + 0.05 * hydro["lift_quadratic_per_rad2"],
            ah=hull,
            Cd1=hydro["hull_drag_per_rad2"] + hydro["induced_k"] * (wing + hull) ** 2,
            Cd0=hydro["cd0"],
            mg=vehicle["mass_kg"],
            Vg=vehicle["hull_volume_m3"],
            epsilon=vehicle["hull_compressibility_per_pa"],
        )
        warmth = of["sci_water_temp_degC"] - vehicle["reference_temperature_degc"]
        warm_cc = 1e6 * vehicle["hull_volume_m3"] * vehicle["hull_thermal_expansion_per_k"] * warmth
        model.set_input_data(
            time=t, pressure=of["pressure_dbar"] / 10, pitch=of["m_pitch_rad"], buoyancy_change=ballast + warm_cc, density=density
        )
        pumping = t[np.abs(np.gradient(ballast, t)) > 0.5]
        near_pump = np.any(np.abs(t[:, None] - pumping[None, :]) < 60, axis=1)
        model.OR(of["pressure_dbar"] < 10)
        if kind == "steady":
            model.OR(near_pump)
        found = model.calibrate("mg", "Cd0")
        seconds = cpu_seconds() - began
        model.solve(model.input_data)
        left = model.w[~model.mask]
        drag = 100 * (found["Cd0"] / hydro["cd0"] - 1)
        trim = 1e6 * (vehicle["mass_kg"] - found["mg"]) / rho
        answers.append({"seconds": seconds, "drag": drag, "trim": trim, "left_cm_s": 100 * float(np.sqrt(np.mean(left**2)))})
    return answers


def rms(values: list[float]) -> float:
    return math.sqrt(statistics.fmean(v * v for v in values)) if values else math.nan


def shown(value: float, form: str) -> str:
    return "–" if math.isnan(value) else format(value, form)


def measure(glider: str, dives: int, dynamic: int, folder: Path) -> list[dict[str, Any]]:
    """One line a tool; the tools take turns mission by mission, so that what else the machine does falls on all of them."""
    asked = {"timeline": "6", "fleet": "", "steady": "2"} | ({"dynamic": "2"} if dynamic else {})
    seen: dict[str, dict[str, Any]] = {
        tool: {"seconds": [], "memory": [], "drag": [], "trim": [], "inside": [], "ratio": [], "left": []} for tool in asked
    }
    for number in range(math.ceil(dives / len(LEGS))):
        some = min(len(LEGS), dives - number * len(LEGS))
        flight = fly(glider, folder, number, some)
        results = {"timeline": timeline(glider, flight), "fleet": fleet(glider, flight), "steady": peer("steady", flight, some)}
        asked["fleet"] = f"{results['fleet']['numbers']}"
        if (more := min(some, dynamic - len(seen.get("dynamic", {"seconds": []})["seconds"]))) > 0:
            results["dynamic"] = peer("dynamic", flight, more)
        truth = dict(zip(("drag", "trim"), HIDDEN[number % len(HIDDEN)], strict=True))
        truth["drag"] *= 100
        base = statistics.median(results["timeline"]["seconds"])
        for tool, result in results.items():
            line = seen[tool]
            line["seconds"] += result["seconds"]
            line["memory"].append(result["memory"])
            line["ratio"].append(statistics.median(result["seconds"]) / base)
            for answer in result["answers"]:
                for name, true in truth.items():
                    line[name].append(answer[name] - true)
                    if "intervals" in answer:
                        interval = answer["intervals"][name]
                        line["inside"].append(interval["low"] <= true <= interval["high"])
                if "left_cm_s" in answer:
                    line["left"].append(answer["left_cm_s"])
        print(f"mission {number + 1}: {some} dives asked", file=sys.stderr, flush=True)
    return [{"tool": tool, "asked": asked[tool]} | seen[tool] for tool in asked]


def intervals(line: dict[str, Any]) -> str:
    """How many of the intervals of drag and trim hold the truth."""
    if line["inside"]:
        return f"{sum(line['inside'])} of {len(line['inside'])}"
    return "not compared" if line["tool"] == "fleet" else "none given"


def table(lines: list[dict[str, Any]]) -> str:
    names = {
        "timeline": "`glider timeline`",
        "fleet": "`glider fleet`",
        "steady": "gliderflight, steady",
        "dynamic": "gliderflight, dynamic",
    }
    head = ["tool", "numbers asked of a dive", "dives", "s of one core a dive, median", "beside timeline (least to most)", "most memory"]
    head += ["drag off by, rms", "trim off by, rms", "90 % intervals that hold the truth", "depth rate left, rms"]
    out = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for line in lines:
        ratio = line["ratio"]
        cells = [
            names[line["tool"]],
            line["asked"],
            str(len(line["seconds"])),
            format(statistics.median(line["seconds"]), ".2f"),
            f"× {statistics.median(ratio):.3g} ({min(ratio):.3g} to {max(ratio):.3g})",
            f"{max(line['memory']):.0f} MiB",
            shown(rms(line["drag"]), ".1f") + (" %" if line["drag"] else ""),
            shown(rms(line["trim"]), ".1f") + (" cm³" if line["trim"] else ""),
            intervals(line),
            shown(rms(line["left"]), ".2f") + (" cm/s" if line["left"] else ""),
        ]
        out.append("| " + " | ".join(cells) + " |")
    return "\n".join(out)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--glider", default="glider", metavar="FILE", help="the program; default: glider on the path")
    parser.add_argument("--dives", type=int, default=40, metavar="N", help="dives to fly and ask about, default 40")
    parser.add_argument("--dynamic", type=int, default=0, metavar="N", help="how many of them the dynamic model gets, default 0")
    parser.add_argument("--json", action="store_true", help="every dive's errors and seconds in place of the table")
    parser.add_argument("--worker", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.worker:
        kind, flight, dives = given.worker
        print(json.dumps(worker(kind, Path(flight), int(dives))))
        return 0
    if given.dives < 1:
        parser.error("--dives must be 1 or more")
    if importlib.util.find_spec("gliderflight") is None:
        print(f"peers: gliderflight is not installed here: {sys.executable} -m pip install {PEER}", file=sys.stderr)
        return 2
    one_core()
    with tempfile.TemporaryDirectory() as folder:
        try:
            lines = measure(given.glider, given.dives, given.dynamic, Path(folder))
        except FileNotFoundError as error:
            print(f"peers: {error.filename}: not found; --glider says where the program is", file=sys.stderr)
            return 2
    print(json.dumps(lines, indent=1) if given.json else table(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
