"""The reader by docs/backseat.md, against `glider surfacing --json`, on messages that the firmware's code makes."""

import importlib.util
import json
import math
from pathlib import Path
from typing import Any

import pytest

from glider_workbench import _core

READER = Path(__file__).parent.parent / "examples/surfacing.py"


def same(read: Any, said: Any) -> None:
    """Equal to the last digit of f32; the program has names for the numbers of a phase, a cause and a switch, and more keys."""
    if isinstance(read, dict):
        for key, value in read.items():
            same(value, said[key])
    elif isinstance(read, list):
        for one, other in zip(read, said, strict=True):
            same(one, other)
    elif isinstance(read, float):
        assert said == pytest.approx(read, rel=2e-7, abs=1e-30)
    else:
        assert read == said


def test_a_reader_written_from_the_page_alone_reads_what_the_board_says(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("surfacing", READER)
    assert spec and spec.loader
    reader = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(reader)
    # A dive to 200 m has a packet; on its own parts the board has none.
    _core.command(["fly", "--seat", "extctl", "--mission", "sea", "--log", str(tmp_path / "backseat")])
    _core.command(["fly", "--seat", "parts", "--mission", "shallow", "--log", str(tmp_path / "parts")])
    data = b"".join(p.read_bytes() for p in [*(tmp_path / "backseat").glob("*.srf"), tmp_path / "parts/shore.srf"])
    file = tmp_path / "both.srf"
    file.write_bytes(data[:70] + data)
    said, _ = _core.command(["surfacing", str(file)])
    expected = json.loads(said)["messages"]
    found = list(reader.messages(file.read_bytes()))
    assert [m["packet"] is None for m in found] == [False, True]
    for read, message in zip(found, expected, strict=True):
        # What has a name there: by its number here, as the page lists them.
        phases = ["Surface", "Dive", "InflectLow", "Climb", "InflectHigh", "Comms", "Done", "Safe"]
        assert phases[read.pop("phase")] == message["phase"]
        assert (read.pop("abort") is None) == (message["abort"] is None)
        assert ["Unknown", "Clear", "Alarm"][read.pop("leak")] == message["leak"]
        assert ["Unknown", "Held", "Released"][read.pop("weight")] == message["weight"]
        assert len(read.pop("flags")) == len(message["degraded"])
        for way, glide in read["glides"].items():
            for angle in ("pitch", "path"):
                assert message["glides"][way][f"{angle}_deg"] == pytest.approx(math.degrees(glide.pop(f"{angle}_rad")), rel=2e-7)
        same(read, message)
