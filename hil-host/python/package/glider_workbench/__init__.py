"""Underwater gliders: compare, diagnose, calibrate and follow flights, one or a whole fleet.

Every function runs the command of the same name of the program ``glider``, in this process and without the interpreter's lock; Ctrl-C ends it.
Units stand in ``attrs``: CF attributes of each variable of a Dataset, and a dictionary ``attrs["units"]`` (column: unit) of a DataFrame. What a
command says besides its table is in ``attrs["document"]``, the document that ``glider … --json`` prints (docs/json.md).

A **flight** is a path (flight directory, csv, or a glider's own files), several paths of one flight's files, what `read` returns, changed or
not, or a Dataset or DataFrame of other names. A **vehicle** is the path of a vehicle file, the name of a built-in one, or its content as a
dictionary; left out, it is the one that came with the flight. Bad input raises `GliderError` (a ValueError), `NotFoundError` (also a
FileNotFoundError) or TypeError.

>>> import glider_workbench as gw
>>> flight = gw.read("trial_dir")
>>> flight.glider.diagnose().attrs["verdict"]
'explained'
"""

from . import _core
from ._accessor import GliderAccessor
from ._answers import Answer
from ._commands import (
    FlightLike,
    FlightsLike,
    StrPath,
    Timeline,
    VehicleLike,
    add,
    calibrate,
    compare,
    diagnose,
    forecast,
    names,
    next_flight,
    polar,
    read,
    report,
    timeline,
    vehicle,
)
from ._core import GliderError, __version__
from ._errors import NotFoundError
from ._faults import Faults, faults
from ._fleet import Fleet, fleet, merge, table
from ._history import History, history

__all__ = [
    "Answer", "Faults", "Fleet", "FlightLike", "FlightsLike", "GliderAccessor", "GliderError", "History", "NotFoundError", "StrPath", "Timeline",
    "VehicleLike", "__version__", "add", "calibrate", "compare", "diagnose", "faults", "fleet", "forecast", "history", "merge", "names", "next_flight", "polar",
    "read", "report", "table", "timeline", "vehicle",
]  # fmt: skip

_core.identify(_core.__file__)
