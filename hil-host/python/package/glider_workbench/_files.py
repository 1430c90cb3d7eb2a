"""Flights and vehicles that live in memory as files that the program reads; nothing of them is left afterwards."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from os import fspath
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr


def _is_path(value: Any) -> bool:
    return isinstance(value, str) or hasattr(value, "__fspath__")


class Files:
    """Temporary files of one call."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="glider-")
        self._count = 0

    def __enter__(self) -> Files:
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def new(self, name: str) -> Path:
        """A name for a file that is not there yet."""
        self._count += 1
        folder = Path(self._folder.name) / str(self._count)
        folder.mkdir()
        return folder / name

    def _written(self, frame: pd.DataFrame, name: str) -> str:
        out = self.new(f"{name or 'flight'}.csv")
        frame.to_csv(out, index=False)
        return str(out)

    def flight(self, flight: Any) -> str:
        """A path for a flight of any kind. One of a glider's own files is read first, as `read` does."""
        if isinstance(flight, xr.Dataset):
            frame = flight.to_dataframe().reset_index().rename(columns={"time": "time_s"})
            first = ["time_s", "segment"]
            return self._written(frame[first + [c for c in frame if c not in first]], Path(flight.attrs.get("name", "")).stem)
        if isinstance(flight, pd.DataFrame):
            return self._written(flight, "")
        if _is_path(flight):
            path = Path(fspath(flight))
            # What is not there is the program's to say, with the name that was meant.
            if path.suffix.lower() == ".csv" or (path / "flight.csv").is_file() or not path.exists():
                return str(path)
        from . import read

        return self.flight(read(flight))

    def mission(self, flight: Any) -> str:
        """A path for a flight of a mission, which may be a folder of flights too."""
        return fspath(flight) if _is_path(flight) else self.flight(flight)

    def vehicle(self, vehicle: Any) -> list[str]:
        """The option that names a vehicle file; none where it is the one beside the flight."""
        if vehicle is None:
            return []
        if isinstance(vehicle, Mapping):
            out = self.new("vehicle.json")
            out.write_text(json.dumps(vehicle))
            return ["--vehicle", str(out)]
        return ["--vehicle", fspath(vehicle)]
