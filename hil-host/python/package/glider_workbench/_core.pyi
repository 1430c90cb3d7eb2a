from collections.abc import Sequence

__version__: str

class GliderError(ValueError):
    """Bad input: the message names the argument and what to do."""

def command(arguments: Sequence[str], /) -> tuple[str, bool]: ...
def read(
    files: Sequence[str], /
) -> tuple[str, list[tuple[str, str, bytes]], float | None, str | None, list[str]]: ...
def table(
    path: str, /
) -> tuple[
    list[tuple[str, list[int]]],
    list[tuple[str, list[str]]],
    list[tuple[str, bytes]],
    list[tuple[str, str]],
]: ...
def identify(file: str, /) -> None: ...
