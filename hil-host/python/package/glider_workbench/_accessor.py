"""The functions as methods of a Dataset: ``flight.glider.compare(vehicle)``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import xarray as xr

from . import _commands
from ._answers import Answer
from ._commands import StrPath, Timeline, VehicleLike
from ._history import History


@xr.register_dataset_accessor("glider")  # type: ignore[no-untyped-call,unused-ignore]
class GliderAccessor:
    """A flight asked by methods; each is the function of the same name with this Dataset as the flight."""

    def __init__(self, flight: xr.Dataset) -> None:
        self._flight = flight

    @property
    def vehicle(self) -> dict[str, Any]:
        """The vehicle file that came with the flight."""
        return _commands.vehicle(self._flight)

    def read(self) -> xr.Dataset:
        """The same flight in the names and units of the flight format."""
        return _commands.read(self._flight)

    def compare(self, vehicle: VehicleLike | None = None) -> Answer:
        """See `glider_workbench.compare`."""
        return _commands.compare(self._flight, vehicle)

    def diagnose(
        self, vehicle: VehicleLike | None = None, *, depth: int = 2, quick: bool = False, history: History | StrPath | None = None
    ) -> Answer:
        """See `glider_workbench.diagnose`."""
        return _commands.diagnose(self._flight, vehicle, depth=depth, quick=quick, history=history)

    def add(self, effects: str | Sequence[str], vehicle: VehicleLike | None = None) -> tuple[dict[str, Any], Answer]:
        """See `glider_workbench.add`."""
        return _commands.add(self._flight, effects, vehicle)

    def calibrate(
        self, vehicle: VehicleLike | None = None, *, free: Sequence[str] = (), one_deployment: bool = False
    ) -> tuple[dict[str, Any], Answer]:
        """See `glider_workbench.calibrate`."""
        return _commands.calibrate(self._flight, vehicle, free=free, one_deployment=one_deployment)

    def timeline(self, vehicle: VehicleLike | None = None, *, dives_per_alarm: float = 1000.0) -> Timeline:
        """See `glider_workbench.timeline`."""
        return _commands.timeline(self._flight, vehicle, dives_per_alarm=dives_per_alarm)

    def forecast(self, vehicle: VehicleLike | None = None, *, mission: StrPath | None = None, surfacings: int = 3) -> Answer:
        """See `glider_workbench.forecast`."""
        return _commands.forecast(self._flight, vehicle, mission=mission, surfacings=surfacings)

    def next_flight(self, vehicle: VehicleLike | None = None) -> Answer:
        """See `glider_workbench.next_flight`."""
        return _commands.next_flight(self._flight, vehicle)

    def report(self, out: StrPath, vehicle: VehicleLike | None = None) -> str:
        """See `glider_workbench.report`."""
        return _commands.report(self._flight, out, vehicle)
