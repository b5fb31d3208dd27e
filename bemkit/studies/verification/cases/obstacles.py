"""One body on a rigid obstacle, most of them shipped scenes with a reference."""

from __future__ import annotations

from collections.abc import Mapping

from bemkit.contact.laws import Coulomb
from bemkit.contact.obstacle import Gap
from bemkit.errors import InputError
from bemkit.geometry.shapes import Ring
from bemkit.operators.material import Material
from bemkit.reference import LameRing, RecedingLayer, errors_of, find_reference, sampled_fields
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.conditions import Contact, Part, Pressure
from bemkit.scene.discretisation import Galerkin
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.studies.verification.case import Case, Measure, Quantity
from bemkit.studies.verification.measures import contact_length, peak_pressure, uniform_error

_PAPER = "static law, friction {}; a fine solution that finite elements confirm to 1e-7"


def uniform_slip() -> Case:
    """Press and shear a block uniformly."""
    bounds = dict.fromkeys(("displacement", "sigma_n", "sigma_t"), (1e-12, 1e-12))
    quantities = _errors("uniform-slip", bounds)
    return Case(load_scene("uniform-slip"), "Wriggers2006", "exact for every mesh", (30, 60), quantities)


def gravity_column() -> Case:
    """Compress a column by its weight."""
    quantities = _errors("gravity-column", {"sigma_n": (1e-11, 1e-11), "energy": (1e-11, 1e-11)})
    validity = "between smooth walls; exact for every mesh"
    return Case(load_scene("gravity-column"), "TimoshenkoGoodier1970", validity, (24, 48), quantities)


def westergaard() -> Case:
    """Press a block on a wavy obstacle."""
    bounds = {"sigma_n": (1e-2, 2e-4, 1e-6), "energy": (1e-4, 2e-8, 1e-11), "transitions": (2e-3, 3e-5, 1e-6)}
    validity = "gentle slopes; the finite height of the block is taken into account"
    return _hp("wavy-obstacle", "Westergaard1939", validity, _errors("wavy-obstacle", bounds))


def disc_between_plates() -> Case:
    """Press a disc between two plates."""
    bounds = {"sigma_n": (1e-2, 5e-5, 1e-6), "energy": (1e-4, 2.5e-9, 1e-11), "transitions": (2e-3, 1e-6, 1e-7)}
    quantities = _errors("disc-between-plates", bounds)
    return _hp("disc-between-plates", "Johnson1985", "small strains; the half-angle may be large", quantities)


def receding_layer() -> Case:
    """Press a layer, which lifts off, on a rigid base."""
    exact = RecedingLayer(1.0, 0.5, 1.0)
    quantities = (
        Quantity("half-width", contact_length, (3e-3, 1e-5, 1e-6), exact.half_width),
        Quantity("peak pressure", peak_pressure, (3e-4, 1e-6, 1e-8), exact.peak_pressure),
    )
    validity = "no friction, no weight; any load and material"
    return _hp("receding-layer", "KeerDundursTsai1972", validity, quantities, middle=2e-5)


def ring_on_shaft() -> Case:
    """Shrink a ring by 0.001 onto a shaft and turn it with nine tenths of the largest torque."""
    material, friction = Material(2.0, 0.3), 0.2
    pressure = 1e-3 / float(LameRing(1.0, 2.0, 1.0, 0.0, material).displacement(1.0))
    shear = 0.9 * friction * pressure
    scene = Scene(
        title="ring on a rigid shaft under a torque",
        shape=Ring(1.0, 2.0),
        material=material,
        parts=(
            Part("shaft", Contact(Gap(-1e-3)), ("inner",)),
            Part("torque", Pressure(0.0, shear=shear / 4.0), ("outer",)),
        ),
        law=Coulomb(friction),
        discretisation=Galerkin(2),
    )

    def slipping(solution: Solution) -> float:
        return float(solution.contact.status_words().count("slip"))

    bounds = (4e-2, 1.3e-2, 3e-3)
    quantities = (
        Quantity(
            "pressure, largest error", lambda found: uniform_error(-found.contact.sigma_n, pressure), bounds, order=1.2
        ),
        Quantity(
            "shear, largest error", lambda found: uniform_error(abs(found.contact.sigma_t), shear), bounds, order=1.2
        ),
        Quantity("nodes that slip", slipping, (0.0, 0.0, 0.0)),
    )
    return Case(scene, "TimoshenkoGoodier1970", "small strains; torque below 2 pi a^2 s p", (32, 64, 128), quantities)


def paper_1() -> Case:
    """Solve Example 1 of the paper."""
    bounds = {
        "sigma_n": (1.5e-3, 1e-4, 1e-6),
        "sigma_t": (1e-2, 1e-3, 2e-6),
        "energy": (2e-5, 1e-8, 1e-12),
        "transitions": (2e-3, 1e-4, 1e-6),
    }
    return _hp("paper-1", "Paper", _PAPER.format(0.5), _errors("paper-1", bounds))


def paper_2() -> Case:
    """Solve Example 2 of the paper."""
    bounds = {
        "sigma_n": (1e-2, 5e-5, 1e-6),
        "sigma_t": (1e-2, 1e-4, 6e-6),
        "energy": (1e-4, 2e-10, 1e-12),
        "transitions": (2e-3, 1e-5, 1e-6),
    }
    return _hp("paper-2", "Paper", _PAPER.format(0.1), _errors("paper-2", bounds))


def _hp(name: str, source: str, validity: str, quantities: tuple[Quantity, ...], middle: float = 5e-5) -> Case:
    """Return a shipped scene with rising degrees.

    The bound of tractions at the first accuracy is at most that accuracy, the bound of the energy its square.
    """

    def solve(scene: Scene, accuracy: float) -> Solution:
        return run(with_overrides(scene, accuracy=accuracy, degree="hp"))

    return Case(load_scene(name), source, validity, (1e-2, middle, 1e-6), quantities, solve)


_NAMES = {"sigma_n": "normal traction, L2", "sigma_t": "shear traction, L2", "displacement": "displacement, L2"}


def _errors(scene: str, bounds: Mapping[str, tuple[float, ...]]) -> tuple[Quantity, ...]:
    """Compare a shipped scene with its reference, by the names of `errors_of`."""
    reference = find_reference(load_scene(scene))
    if reference is None:
        raise InputError(f"scene {scene!r} has no reference: give it one in bemkit.reference.shipped")

    def error(name: str) -> Measure:
        return lambda solution: errors_of(sampled_fields(solution, reference.places), reference)[name]

    return tuple(Quantity(_NAMES.get(name, name), error(name), bound) for name, bound in bounds.items())
