"""The example notebook runs from top to bottom: its cells one after the other, as a kernel would, without bringing one."""

import json
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

NOTEBOOK = Path(__file__).parent.parent / "examples/first_flight.ipynb"


def test_the_example_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = json.loads(NOTEBOOK.read_text())
    assert notebook["nbformat"] == 4
    cells = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]
    monkeypatch.chdir(tmp_path)
    plt.close("all")
    names: dict = {"__name__": "__main__"}
    for number, source in enumerate(cells):
        exec(compile(source, f"{NOTEBOOK.name}, code cell {number}", "exec"), names)
    assert len(cells) >= 5 and len(plt.get_fignums()) == 1, "a figure is drawn"
    assert names["mission"].dives.sizes["dive"] == 8
    plt.close("all")
