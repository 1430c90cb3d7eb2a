"""What is raised: the argument that is meant and what to do, in the words of Python."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any, NoReturn

from ._core import GliderError


class NotFoundError(GliderError, FileNotFoundError):
    """A flight, a vehicle or a history that is not there."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


#: Functions that do what a command of the program does, as messages name them.
_FUNCTIONS = {
    "add", "calibrate", "compare", "diagnose", "faults", "fleet", "history", "polar", "report", "timeline",
}  # fmt: skip
_OTHERS = {"import": "read", "next-flight": "next_flight", "fleet merge": "merge", "list": "names"}


def _function(command: str, argument: str | None) -> str:
    if command == "list" and argument:
        return f'glider_workbench.names("{argument}")'
    name = _OTHERS.get(command, command if command in _FUNCTIONS else None)
    return f"glider_workbench.{name}" if name else f"glider {command}"


def in_words_of_python(text: str, names: Mapping[str, str]) -> str:
    """A message of the program with arguments in place of temporary files, options and commands; ``names``: path → argument."""
    text = re.sub(r"^error: ", "", text.strip())
    text = re.split(r"\n\s*(?:Usage:|For more information)", text)[0]
    text = re.sub(r"\n *\^ *$", "", text.rstrip())
    text = re.sub(r"\s*\n\s*", "; ", text)
    text = text.replace("glider fly --fault", 'glider_workbench.names("faults")')
    for path, name in sorted(names.items(), key=lambda n: -len(n[0])):
        # Line 1 is the header that was made here; rows count from 0, as those of a frame do.
        text = re.sub(
            re.escape(path) + r"(?:/flight\.csv|/[^/\s,:]+\.nc)?(, line (\d+))?",
            lambda m, name=name: name if not m[2] else f"{name}, its names" if m[2] == "1" else f"{name}, row {int(m[2]) - 2}",  # type: ignore[misc]
            text,
        )
    text = re.sub(r"invalid value '([^']*)' for '--([a-z-]+)[^']*'", lambda m: f"{m[2].replace('-', '_')}: {m[1]!r}", text)
    text = re.sub(r"`?\bglider (import|next-flight|fleet merge|list|[a-z]+)\b(?: ([a-z]+)\b)?`?", _in_python, text)
    text = re.sub(r"--(flight|vehicle)\b", r"\1=", text)
    return re.sub(r"--([a-z][a-z-]*)", lambda m: m[1].replace("-", "_"), text)


def _in_python(match: re.Match[str]) -> str:
    name = _function(match[1], match[2])
    if not name.startswith("glider_workbench"):
        return match[0]
    return name + (f" {match[2]}" if match[2] and match[1] != "list" else "")


def wrong_type(name: str, value: Any, wanted: str) -> NoReturn:
    """Refuses an argument of another type."""
    kind = "None" if value is None else f"a {type(value).__name__}"
    raise TypeError(f"{name}: {kind}; give {wanted}")


def is_path(value: Any) -> bool:
    """Whether a value names a file."""
    return isinstance(value, (str, PathLike))


def path(name: str, value: Any) -> str:
    """An argument that names a file to write."""
    if not is_path(value):
        wrong_type(name, value, "a path")
    text = fspath(value)
    if not isinstance(text, str) or not text:
        raise GliderError(f"{name}: an empty path; name a file")
    folder = Path(text).parent
    if not folder.is_dir():
        raise NotFoundError(f"{name}: there is no folder {folder}; make it first, or name another")
    return text


def there(name: str, value: Any) -> str:
    """An argument that names a file or folder which has to be there."""
    text = fspath(value)
    if not text or not Path(text).exists():
        raise NotFoundError(f"{name}: {text or 'an empty path'}: no such file or folder; paths count from {Path.cwd()}")
    return str(text)


def number(name: str, value: Any, low: float, high: float, unit: str = "") -> float:
    """An argument that is a number in a range."""
    if isinstance(value, bool) or not hasattr(value, "__float__") or isinstance(value, str):
        wrong_type(name, value, f"a number from {low:g} to {high:g} {unit}".rstrip())
    out = float(value)
    if not low <= out <= high:
        raise GliderError(f"{name}: {out:g}; give a number from {low:g} to {high:g} {unit}".rstrip())
    return out


def whole(name: str, value: Any, low: int, high: int) -> int:
    """An argument that is a whole number in a range."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        wrong_type(name, value, f"a whole number from {low} to {high}")
    out = int(value)
    if not low <= out <= high:
        raise GliderError(f"{name}: {out}; give a whole number from {low} to {high}")
    return out


def flag(name: str, value: Any) -> bool:
    """An argument that is true or false."""
    if type(value).__name__ not in ("bool", "bool_"):
        wrong_type(name, value, "True or False")
    return bool(value)


def texts(name: str, value: Any, what: str) -> list[str]:
    """An argument of one name or several."""
    several = [value] if isinstance(value, str) else value
    if not isinstance(several, Sequence) or isinstance(several, bytes):
        wrong_type(name, value, f"{what}, or a list of them")
    out = []
    for k, one in enumerate(several):
        if not isinstance(one, str):
            wrong_type(f"{name}[{k}]", one, what)
        if not one.strip():
            raise GliderError(f"{name}: an empty name; give {what}")
        out.append(one)
    return out
