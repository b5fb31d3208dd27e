"""Print the lowest version that pyproject.toml allows of each dependency, as constraints for pip."""

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
extras = project["optional-dependencies"]
named = [*project["dependencies"], *extras["test"], *extras["fast"]]
print(*sorted({re.sub(">=", "==", requirement) for requirement in named}), sep="\n")
