"""The types of the package, as mypy --strict reads them where it is installed."""

import subprocess
import sys
from pathlib import Path

PROGRAM = """
import glider_workbench as gw
import xarray as xr

flight: xr.Dataset = gw.read("dives")
known, numbers = gw.calibrate([flight], {"mass_kg": 60.0}, free=["mass"])
found: gw.Answer = gw.diagnose(flight, known, depth=3)
line: gw.Timeline = gw.timeline(flight, known)
rms: float = gw.compare("trial").attrs["rms"]
reveal_type(gw.polar(known))
gw.diagnose(flight, depth="two")
"""


def test_the_package_and_a_program_that_uses_it_are_typed(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    run = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(Path(__file__).parents[3] / "data-cache/mypy")]
    package = subprocess.run([*run, "-p", "glider_workbench"], capture_output=True, text=True, cwd=tmp_path)
    assert package.returncode == 0, package.stdout + package.stderr
    program = subprocess.run([*run, "program.py"], capture_output=True, text=True, cwd=tmp_path)
    wrong = [line for line in program.stdout.splitlines() if "error" in line and "Found" not in line]
    assert len(wrong) == 1 and "depth" in wrong[0] and "Dataset" in program.stdout, program.stdout
