"""Print the lower bounds of pyproject.toml as pins: what is promised is tried."""

import tomllib
from pathlib import Path

project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
for line in project["dependencies"] + project["optional-dependencies"]["test"]:
    name, bound = line.split(">=")
    # the last patch of a bound that names none
    print(f"{name}=={bound}" if bound.count(".") > 1 else f"{name}=={bound}.*")
