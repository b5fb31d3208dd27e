"""Words for classes: installed packages add their own."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bemkit.runs.run import run
from bemkit.scene.registry import CONDITIONS, DISCRETISATIONS, GRADINGS, LAWS, OBSTACLES, SHAPES, SOLVERS, Registry
from bemkit.scene.toml import SceneError, scene_from_toml, scene_to_toml, shipped_files

PAPER_1 = shipped_files()["paper-1"].read_text("utf-8")

PLUGIN = """
from dataclasses import dataclass
import numpy as np
from bemkit.contact.laws import FrictionLaw

@dataclass(frozen=True)
class Sticky(FrictionLaw):
    strength: float = 1.0

    def bound(self, sigma_n):
        return np.full_like(sigma_n, self.strength)

    def bound_derivative(self, sigma_n):
        return np.zeros_like(sigma_n)

class NotADataclass:
    pass

@dataclass(frozen=True)
class Ramp:
    slope: float = 0.0

    def gap(self, points, normals):
        return self.slope * points[:, 0]

from bemkit.solvers.ssn import SemismoothNewton

@dataclass(frozen=True)
class Patient(SemismoothNewton):
    patience: int = 1
"""

ENTRY_POINTS = """
[bemkit.laws]
sticky = bemkit_test_plugin:Sticky
broken = bemkit_test_plugin:Missing
loose = bemkit_test_plugin:NotADataclass
coulomb = bemkit_test_plugin:Sticky

[bemkit.obstacles]
ramp = bemkit_test_plugin:Ramp

[bemkit.solvers]
patient = bemkit_test_plugin:Patient
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    (tmp_path / "bemkit_test_plugin.py").write_text(PLUGIN, "utf-8")
    information = tmp_path / "bemkit_test_plugin-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: bemkit-test-plugin\nVersion: 1.0\n", "utf-8")
    (information / "entry_points.txt").write_text(ENTRY_POINTS, "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("bemkit_test_plugin", None)


@pytest.mark.parametrize(
    "registry",
    [SHAPES, GRADINGS, CONDITIONS, OBSTACLES, LAWS, DISCRETISATIONS, SOLVERS],
    ids=lambda registry: registry.role,
)
def test_every_built_in_word_names_a_class(registry: Registry) -> None:
    for kind, reference in registry.built_in.items():
        found = registry.find(kind)
        assert f"{found.__module__}:{found.__qualname__}" == reference


@pytest.mark.usefixtures("plugin")
def test_an_installed_law_works_in_scene_files() -> None:
    text = PAPER_1.replace('"coulomb"\nfriction_coefficient = 0.5', '"sticky"\nstrength = 3.0')
    scene = scene_from_toml(text)
    assert type(scene.law).__name__ == "Sticky"
    assert 'kind = "sticky"\nstrength = 3.0' in scene_to_toml(scene)


@pytest.mark.usefixtures("plugin")
def test_installed_laws_obstacles_and_solvers_solve_scenes() -> None:
    half_plane = '{ kind = "half-plane", point = [0.0, 0.0], normal = [0.0, 1.0] }'
    text = PAPER_1.replace("elements = 320", "elements = 60")
    assert half_plane in text
    text = text.replace(half_plane, '{ kind = "ramp", slope = 1e-6 }')
    text = text.replace('"semismooth-newton"', '{ kind = "patient", patience = 3 }')
    text = text.replace('"coulomb"\nfriction_coefficient = 0.5', '"sticky"\nstrength = 0.1')
    scene = scene_from_toml(text)
    assert scene_from_toml(scene_to_toml(scene)) == scene
    solution = run(scene)
    assert solution.is_converged
    np.testing.assert_allclose(solution.contact.gap, 1e-6 * solution.contact.x, rtol=1e-12)
    slips = np.array(solution.contact.status_words()) == "slip"
    np.testing.assert_allclose(np.abs(solution.contact.sigma_t[slips]), 0.1, rtol=1e-9)
    assert slips.any()


@pytest.mark.usefixtures("plugin")
def test_built_in_words_cannot_be_taken_over() -> None:
    assert LAWS.find("coulomb").__module__ == "bemkit.contact.laws"


@pytest.mark.usefixtures("plugin")
@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("broken", "law.kind: friction law 'broken' .* cannot be loaded: .*Missing"),
        ("loose", "law.kind: friction law 'loose' .* is not a dataclass"),
        ("stiky", "unknown friction law 'stiky'.*sticky.*did you mean 'sticky'"),
    ],
)
def test_plugins_that_do_not_work_say_why(kind: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        scene_from_toml(PAPER_1.replace('"coulomb"', f'"{kind}"'))
