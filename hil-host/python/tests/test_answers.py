"""Answers: tidy frames, what a notebook shows of them, the mission, the history."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pandas as pd
import pytest

import glider_workbench as gw


@pytest.fixture(scope="module")
def found(trial: Path) -> gw.Answer:
    return gw.diagnose(trial, quick=True)


def test_flights_of_one_name_go_by_their_place_in_the_list(archive: Path) -> None:
    flights = [gw.read(archive / f"may/flight{k}").assign_attrs(name="one") for k in range(2)]
    line = gw.timeline(flights, gw.vehicle(flights[0]))
    assert list(dict.fromkeys(line.dives["flight"].values)) == ["flights[0]", "flights[1]"]
    assert not re.search(r"/glider-\w{8}/", str(line.document) + str(gw.calibrate(flights)[1].attrs["document"]))


def test_a_diagnosis_has_one_row_an_effect_and_parameter(found: gw.Answer) -> None:
    candidates = found.attrs["document"]["candidates"]
    assert len(found) == sum(max(1, len(c["parameters"])) for c in candidates)
    assert not found.duplicated(["rank", "effect", "parameter"]).any()
    assert found.map(lambda v: not isinstance(v, (list, dict))).all().all(), "no cell is a list"
    c = candidates[1]
    of = found[found["rank"] == 2]
    for name, p in c["parameters"].items():
        row = of[of["effect"] + "." + of["parameter"] == name].iloc[0]
        assert (row["value"], row["low"], row["high"]) == (p["value"], p["low"], p["high"])
    assert type(found[found["rank"] < 3]) is pd.DataFrame


def test_a_notebook_shows_an_answer_with_its_forest_plot(found: gw.Answer, trial: Path) -> None:
    _, added = gw.add(trial, "drag_level_error")
    calibrated = gw.calibrate(trial)[1]
    for answer in (found, added, calibrated):
        html = answer._repr_html_()
        assert "<b>" in html and "<table" in html
        picture = ElementTree.fromstring(re.search(r"<svg.*</svg>", html, re.DOTALL)[0])
        dots = picture.findall("{*}circle")
        assert len(dots) == min(16, answer[["value", "low", "high"]].notna().all(axis=1).sum())
    # Its value stands between its ends, on the side of the line that its sign says.
    row = added.iloc[0]
    picture = ElementTree.fromstring(re.search(r"<svg.*</svg>", added._repr_html_(), re.DOTALL)[0])
    line, *intervals = picture.findall("{*}line")
    zero, x = float(line.get("x1")), float(picture.find("{*}circle").get("cx"))
    assert float(intervals[0].get("x1")) < x < float(intervals[0].get("x2")) and (x > zero) == (row["value"] > 0)
    assert "<svg" not in gw.compare(trial)._repr_html_()


def test_the_mission_of_the_next_flight_is_a_mission_file(tmp_path: Path) -> None:
    from glider_workbench import _core

    # A flight at one pitch cannot tell drag from lift; one that can be told apart has a mission.
    _core.command(["fly", "--mission", "sea", "--seed", "2", "--log", str(tmp_path / "one")])
    legs = gw.next_flight(tmp_path / "one")
    assert set(legs.columns) >= {"pitch_deg", "ballast_cc", "expected_chi2"} or legs.empty
    if legs.attrs["tells_apart"]:
        (tmp_path / "mission.toml").write_text(legs.attrs["mission"])
        _core.command(["fly", "--mission", str(tmp_path / "mission.toml"), "--log", str(tmp_path / "next")])
        assert (tmp_path / "next/flight.csv").is_file() and gw.read(tmp_path / "next")["segment"].max() >= len(legs) - 1
    else:
        assert legs.attrs["mission"] is None
    assert legs.attrs["tells_apart"], legs.attrs


def test_a_history_is_learnt_extended_and_judges(trial: Path, archive: Path, tmp_path: Path) -> None:
    known, numbers = gw.calibrate(trial)
    history = numbers.attrs["history"]
    assert isinstance(history, gw.History) and len(history.units) == 8 and isinstance(history.predicts_itself, bool)
    more = gw.history(history, add=archive / "may/flight0")
    assert len(more.units) == 16 and len(history.units) == 8
    assert len(gw.history(more).units) == 16
    file = more.save(tmp_path / "known.history")
    again = gw.history(file)
    assert again.text == more.text and again.vehicle == known
    found = gw.diagnose(archive / "may/flight1", known, quick=True, history=file)
    assert found.attrs["document"]["history"]["controls"] == more.document["controls"]
