"""What earlier dives of a vehicle say."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import pandas as pd

from . import _errors
from ._answers import Answer, answer
from ._core import GliderError
from ._files import Files


@dataclass(frozen=True, eq=False)
class History:
    """Earlier dives of a vehicle, by which the next is judged."""

    numbers: Answer
    """Mean and scatter between dives of each number, in usual sizes of an error."""
    units: pd.DataFrame
    """One row a dive: whether it is quiet, how far it is from the others."""
    document: dict[str, Any]
    """All that ``glider history --json`` says."""
    text: str = field(repr=False)
    """The history file."""
    vehicle: dict[str, Any] | None = field(repr=False, default=None)
    """The vehicle file that it was learnt with."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, History) and other.text == self.text

    def __deepcopy__(self, memo: object) -> History:
        # It stands in the `attrs` of a frame, which pandas copies with every frame that is made of it.
        return self

    @property
    def predicts_itself(self) -> bool:
        """Whether its quiet dives are alike, so that it may judge."""
        return bool(self.document["gate"]["predicts_itself"])

    def save(self, path: str | PathLike[str]) -> str:
        """Writes the history file, and the vehicle file of the same name (``.json``), which the program looks for next to it."""
        out = Path(_errors.path("path", path))
        if out.suffix != ".history":
            raise GliderError(f"path: {out}: name a file that ends in .history")
        out.write_text(self.text)
        if self.vehicle is not None:
            out.with_suffix(".json").write_text(json.dumps(self.vehicle, indent=1))
        return str(out)


def learnt(file: Path, vehicle: Mapping[str, Any] | None, document: Mapping[str, Any] | None) -> History | None:
    """The history in a file that the program wrote."""
    if document is None or not file.exists():
        return None
    controls = f"{len(document['units'])} dives, {document['controls']} quiet ones judge the next"
    numbers = answer(document["numbers"], document, {}, controls)
    made = dict(vehicle) if vehicle is not None else None
    return History(numbers, pd.DataFrame(document["units"]), dict(document), file.read_text(), made)


def history_file(files: Files, history: Any) -> str:
    """A path for a history of any kind."""
    if isinstance(history, History):
        out = files.new("vehicle.history", "history")
        out.write_text(history.text)
        return str(out)
    if not _errors.is_path(history):
        _errors.wrong_type("history", history, "a History of calibrate(), or the path of a .history file")
    return _errors.there("history", history)


def history(
    history: History | str | PathLike[str], add: Any = (), vehicle: Any = None, *, accept: bool = False
) -> History:
    """What earlier dives of a vehicle say; with ``add`` the dives of further flights are judged and added, in the order of time.

    Quiet dives become controls; those that are not are kept and do not judge, unless ``accept`` says that they are the new normal.
    A file that is named stays as it is: `History.save` writes the one that is returned.
    """
    accepted = _errors.flag("accept", accept)
    flights: Sequence[Any] = list(add) if isinstance(add, (list, tuple)) else [add]
    if accepted and not flights:
        raise GliderError("accept: there is nothing to accept; give flights to add")
    with Files() as files:
        file = files.new("vehicle.history", "history")
        file.write_text(Path(history_file(files, history)).read_text())
        known = vehicle if vehicle is not None else history.vehicle if isinstance(history, History) else _next_to(history)
        if flights and known is None:
            raise GliderError("vehicle: no vehicle file of that name lies next to the history; give vehicle=")
        options = [part for k, f in enumerate(flights) for part in ("--add", files.flight(f, f"add[{k}]"))]
        options += [*files.vehicle(known), *(["--accept"] if accepted else [])] if flights else []
        d, _ = files.run("history", file, *options)
        made = learnt(file, known if isinstance(known, Mapping) else _loaded(known), d)
    if made is None:
        raise GliderError("history: it holds no dive; calibrate on more of them")
    return made


def _next_to(history: Any) -> str | None:
    files = [Path(fspath(history)).with_suffix(ending) for ending in (".json", ".toml")]
    return next((str(f) for f in files if f.is_file()), None)


def _loaded(vehicle: Any) -> dict[str, Any] | None:
    if vehicle is None or Path(fspath(vehicle)).suffix != ".json":
        return None
    made: dict[str, Any] = json.loads(Path(fspath(vehicle)).read_text())
    return made
