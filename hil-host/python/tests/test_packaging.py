"""What is stated of the package in several places is the same in all."""

import re
from importlib.metadata import metadata
from pathlib import Path

import yaml

import glider_workbench as gw

HERE = Path(__file__).parents[1]


def test_metadata_and_the_conda_recipe_say_the_same() -> None:
    said, recipe = metadata("glider-workbench"), yaml.safe_load((HERE / "recipe.yaml").read_text())
    assert said["Version"] == gw.__version__ == recipe["context"]["version"]
    assert said["License-Expression"] == recipe["about"]["license"] and said["Requires-Python"] == f">={recipe['context']['python_min']}"
    assert said["Summary"] == recipe["about"]["summary"] and "# glider-workbench" in (said["Description"] or said.get_payload())
    needed = {r.replace(" ", "") for r in said.get_all("Requires-Dist") if "extra" not in r}
    assert needed == {r.replace(" ", "") for r in recipe["requirements"]["run"] if "python" not in r}
    assert {"netcdf", "plot", "dask"} == set(said.get_all("Provides-Extra"))
    assert {"LICENSE-MIT", "LICENSE-APACHE"} <= {Path(f).name for f in said.get_all("License-File")}


def test_every_function_is_in_the_table_of_the_page() -> None:
    page = (HERE.parents[1] / "docs/python.md").read_text()
    rows = set(re.findall(r"^\| `(\w+)\(", page, re.MULTILINE))
    functions = {n for n in gw.__all__ if n.islower() and not n.startswith("_") and callable(getattr(gw, n))}
    assert functions - {"merge", "table"} == rows
