"""Other people's tools and ours on the same data, in turn.

  dynamic fit     gliderflight 1.2.1, DynamicCalibrate (mg, Cd0; inertia), against ours (ten calibration numbers)
  steady fit      gliderflight 1.2.1, SteadyStateCalibrate (mg, Cd0)
  free dynamics   pysindy: depth rate learnt from pitch, ballast and density, no physics
  which effect    scikit-learn LassoLarsIC and abess on the signatures of our catalogue, against our diagnosis

Error of a fit: 20 s blocks of segments that no fit has seen, slope of measured
depth minus slope of modelled depth, rms - the same rows for everybody.
Times are CPU times, of all processes of a tool, from data in memory to the answer: other work on the machine does not
count, and two processes (gliderflight on two cores) do not look faster than the work they do. Every tool runs as its
authors ship it.
"""
import csv, json, logging, os, resource, statistics, subprocess, sys, warnings
import numpy as np

warnings.filterwarnings("ignore")
logging.disable(logging.CRITICAL)
ours, work, table, rounds = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])
flight = os.path.join(work, "flights", "comet2016")
lines = []


def put(key, values, unit):
    """Median, least and most of what was seen."""
    line = "\t".join([key, repr(float(statistics.median(values))), repr(float(min(values))), repr(float(max(values))), unit])
    lines.append(line)
    print(line, flush=True)


def call(*arguments):
    said = subprocess.run([ours, *arguments], check=True, capture_output=True, text=True).stdout
    return json.loads(said.strip().splitlines()[-1])


def cpu():
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(r.ru_utime + r.ru_stime for r in spent)


def timed(work):
    begin = cpu()
    out = work()
    return cpu() - begin, out


# ---- the flight, as everybody gets it ----------------------------------
with open(os.path.join(flight, "flight.csv")) as f:
    rows = list(csv.DictReader(f))
column = lambda name: np.array([float(r[name]) if r[name] else np.nan for r in rows])
t, segment = column("time_s"), column("segment").astype(int)
pressure = column("pressure_dbar")
pitch, ballast, density = column("m_pitch_rad"), column("m_ballast_pumped_cc"), column("sci_density_kg_m3")
for c in (pressure, pitch, ballast, density):
    gaps = ~np.isfinite(c)
    c[gaps] = np.interp(t[gaps], t[~gaps], c[~gaps])
check_segment = segment % 3 == 1  # as the vehicle file of the flight says
rows_file = os.path.join(work, "rows.csv")


def blocks():
    with open(rows_file) as f:
        told = list(csv.DictReader(f))
    number = np.array([int(r["block"]) for r in told])
    take = lambda name: np.array([float(r[name]) for r in told])
    return number, take("time_s"), take("check") > 0, take("depth_m"), take("model_m")


def heldout(model_depth):
    """rms over check blocks of the slope of measured minus modelled depth, m/s; model_depth(times) in m."""
    number, at, check, depth, _ = blocks()
    model = model_depth(at)
    errors = []
    for b in np.unique(number[check]):
        rows_of = number == b
        slope = lambda y: np.polyfit(at[rows_of] - at[rows_of][0], y, 1)[0]
        errors.append(slope(depth[rows_of]) - slope(model[rows_of]))
    return float(np.sqrt(np.mean(np.square(errors))))


def along(w_up, times=t):
    """Depth from a vertical velocity, positive up."""
    w = np.nan_to_num(w_up)
    depth = np.concatenate([[0.0], np.cumsum(-0.5 * (w[1:] + w[:-1]) * np.diff(times))])
    return lambda at: np.interp(at, times, depth)


# ---- fits ---------------------------------------------------------------
import gliderflight


def fit(kind, **more):
    def work():
        model = kind(rho0=float(np.mean(density)), **more)
        model.define(mg=70.0, Vg=70.0 / float(np.mean(density)), Cd0=0.15)
        model.set_input_data(time=t, pressure=pressure / 10, pitch=pitch, buoyancy_change=ballast, density=density)
        model.OR(pressure < 10)  # as its documentation does
        model.OR(check_segment)
        model.calibrate("mg", "Cd0")
        model.solve(model.input_data)
        return model

    return timed(work)


def sindy():
    import pysindy

    w = -np.gradient(pressure, t)  # dbar/s: near enough m/s, positive up

    def work():
        controls = np.column_stack([pitch, ballast / 200, (density - density.mean()) / 5])
        runs = [np.flatnonzero((segment == s) & (pressure > 2)) for s in np.unique(segment[~check_segment])]
        runs = [r for r in runs if len(r) > 60]
        model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=1e-3), feature_library=pysindy.PolynomialLibrary(degree=2))
        smooth = lambda x: np.convolve(x, np.ones(9) / 9, mode="same")
        model.fit([smooth(w[r])[:, None] for r in runs], t=[t[r] for r in runs], u=[controls[r] for r in runs], feature_names=["w", "pitch", "ballast", "density"])
        return model, controls

    seconds, (model, controls) = timed(work)
    # Integrated through each segment from rest, with its own controls.
    out = np.zeros_like(w)
    rate = lambda state, k: float(np.clip(model.predict(np.array([[state]]), u=controls[k : k + 1])[0, 0], -0.5, 0.5))
    for s in np.unique(segment[check_segment]):
        state = 0.0
        for k in np.flatnonzero(segment == s):
            step = t[k] - t[k - 1] if k else 0.0
            state = float(np.clip(state + step * rate(state, k), -1.0, 1.0))
            out[k] = state
    return seconds, out


# What `glider diagnose` ranks first on this flight. Its size is not that of water carried along: it stands for ballast that
# is reported late, which no effect of the catalogue describes.
PAIR = ["added_mass", "induced_drag_error"]
seen = {name: [] for name in ("ours", "pair", "dynamic", "steady", "sindy")}
errors = {name: [] for name in seen}
ratio = {name: [] for name in ("dynamic", "pair", "steady", "sindy")}
for k in range(rounds):
    told = call("fit", flight, rows_file)
    seen["ours"].append(told["seconds"])
    _, at, _, _, model = blocks()
    errors["ours"].append(heldout(lambda times: model))
    seen["pair"].append(call("fit", flight, rows_file, *PAIR)["seconds"])
    _, at, _, _, model = blocks()
    errors["pair"].append(heldout(lambda times: model))
    for name in ("dynamic", "steady"):
        kind = gliderflight.DynamicCalibrate if name == "dynamic" else gliderflight.SteadyStateCalibrate
        more = dict(k1=0.20, k2=0.92) if name == "dynamic" else {}
        seconds, fitted = fit(kind, **more)
        print(f"round {k + 1} of {rounds}: gliderflight {name} took {seconds:.1f} s of CPU", file=sys.stderr, flush=True)
        seen[name].append(seconds)
        errors[name].append(heldout(along(fitted.modelresult.w)))
        again = call("fit", flight, rows_file)["seconds"]
        seen["ours"].append(again)
        ratio[name].append(seconds / statistics.mean(seen["ours"][-2:]))
        if name == "dynamic":
            seen["pair"].append(call("fit", flight, rows_file, *PAIR)["seconds"])
            ratio["pair"].append(seconds / statistics.mean(seen["pair"][-2:]))
    try:
        seconds, w = sindy()
        seen["sindy"].append(seconds)
        errors["sindy"].append(heldout(along(w)))
        ratio["sindy"].append(seconds / seen["ours"][-1])
    except Exception as e:  # a peer that fails is said to fail
        print(f"pysindy failed: {e}", file=sys.stderr)
for name in seen:
    if seen[name]:
        put(f"fit.{name}", seen[name], "s")
        put(f"fit.{name}.heldout", errors[name], "m/s")
for name in ratio:
    if ratio[name]:
        put(f"fit.{name}.ratio", ratio[name], "1")

# ---- which effect ---------------------------------------------------------
from sklearn.linear_model import LassoLarsIC

try:
    from abess.linear import LinearRegression as Abess
except ImportError:
    Abess = None


def sparse(matrix_file, choose):
    with open(matrix_file) as f:
        names = f.readline().strip().split(",")
        m = np.loadtxt(f, delimiter=",")
    y, calibration, effects = m[:, 0], m[:, 1:11], m[:, 11:]

    def work():
        # Calibration is free within its tolerance (unit priors): its part is taken out of data and columns first.
        gram = calibration.T @ calibration + np.eye(calibration.shape[1])
        out = lambda x: x - calibration @ np.linalg.solve(gram, calibration.T @ x)
        x, r = out(effects), out(y)
        scale = np.sqrt(np.sum(x * x, axis=0))
        # What leaves no trace beside the calibration cannot be chosen.
        seen_at_all = scale > 1e-6 * scale.max()
        weights = np.zeros(x.shape[1])
        weights[seen_at_all] = choose(x[:, seen_at_all] / scale[seen_at_all], r)
        return weights

    seconds, weights = timed(work)
    weights = np.abs(weights)
    return seconds, ([] if weights.max() == 0 else [names[11 + int(np.argmax(weights))]])


peers = {"lasso": lambda x, y: LassoLarsIC(criterion="bic", fit_intercept=False).fit(x, y).coef_}
if Abess:
    def best_subset(x, y):
        model = Abess(path_type="seq", support_size=range(0, 4), ic_type="ebic", fit_intercept=False)
        model.fit(x, y)
        return model.coef_
    peers["abess"] = best_subset
cases = call("cases", os.path.join(work, "cases"), "24", "4242")
named = {name: [] for name in ("ours", *peers)}
took = {name: [] for name in named}
matrix_file = os.path.join(work, "matrix.csv")
for case in cases:
    told = call("find", case["path"], matrix_file)
    took["ours"].append(told["seconds"])
    answer = told["answer"] or []
    in_class = any(c == case["hidden"] for c in told["equivalent"]) and told["verdict"] in ("explained", "ambiguous")
    named["ours"].append(answer == case["hidden"] or in_class)
    for name, choose in peers.items():
        seconds, chosen = sparse(matrix_file, choose)
        # Theirs starts from our signatures: making them is part of the way.
        took[name].append(seconds + told["matrix_seconds"])
        named[name].append(chosen == case["hidden"])
for name in named:
    put(f"find.{name}", took[name], "s")
    share = float(np.mean(named[name]))
    put(f"find.{name}.named", [share], "1")
put("find.cases", [len(cases)], "1")

with open(table, "w") as f:
    f.write("\n".join(lines) + "\n")
print(f"wrote {table}")
