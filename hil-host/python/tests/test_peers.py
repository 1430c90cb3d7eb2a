"""The example that asks other people's tools the same: its own part, and all of it on one dive where gliderflight is installed."""

import importlib.util
import sys
import warnings
from pathlib import Path
from types import ModuleType

import pytest

import glider_workbench

PROGRAM = Path(__file__).parent.parent / "examples/peers.py"


@pytest.fixture
def peers() -> ModuleType:
    spec = importlib.util.spec_from_file_location("peers", PROGRAM)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def glider(tmp_path: Path) -> str:
    """A program that runs the commands of the module under test."""
    program = tmp_path / "glider"
    package = Path(glider_workbench.__file__).parents[1]
    program.write_text(
        f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {str(package)!r})\nfrom glider_workbench import _core\n"
        "said, positive = _core.command([a for a in sys.argv[1:] if a != '--json'])\nprint(said)\nsys.exit(not positive)\n"
    )
    program.chmod(0o755)
    return str(program)


def test_without_gliderflight_it_says_how_to_get_it(
    peers: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["peers.py", "--dives", "1"])
    assert peers.main() == 2
    assert "pip install gliderflight==" in capsys.readouterr().err


def test_our_part_answers_on_one_dive(peers: ModuleType, glider: str, tmp_path: Path) -> None:
    flight = peers.fly(glider, tmp_path / "world", 1, 1)
    asked = peers.timeline(glider, flight)
    assert len(asked["answers"]) == 1 and asked["seconds"][0] > 0
    # Hidden: 10 % of drag and 10 cm3. One dive does not tell drag from the scale of the pitch sensor; its intervals say so.
    answer = asked["answers"][0]
    for name, off in (("drag", 10), ("trim", 10)):
        assert answer["intervals"][name]["low"] < 10 < answer["intervals"][name]["high"] and abs(answer[name] - 10) < off, answer
    assert peers.fleet(glider, flight)["numbers"] > 6


def test_one_dive_asked_of_all(peers: ModuleType, glider: str, tmp_path: Path) -> None:
    if importlib.util.find_spec("gliderflight") is None:
        warnings.warn(f"SKIPPED LOUDLY: no gliderflight in {sys.prefix} (pip install {peers.PEER})", stacklevel=1)
        pytest.skip("no gliderflight")
    lines = peers.measure(glider, 1, 0, tmp_path / "world")
    assert [line["tool"] for line in lines] == ["timeline", "fleet", "steady"]
    steady = lines[2]
    assert abs(steady["drag"][0]) < 6 and abs(steady["trim"][0]) < 10 and 0 < steady["left"][0] < 1
    assert "gliderflight, steady" in peers.table(lines)
