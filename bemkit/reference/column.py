"""Columns under their weight, which contact carries."""

from __future__ import annotations

from dataclasses import dataclass

from bemkit.operators.material import Material
from bemkit.reference.hertz import check_positive


def uniaxial_strain_modulus(material: Material) -> float:
    """Return lambda + 2 mu [Pa]: stress per strain between smooth, rigid walls."""
    nu = material.effective_poisson_ratio
    return 2.0 * material.shear_modulus * (1.0 - nu) / (1.0 - 2.0 * nu)


@dataclass(frozen=True)
class GravityColumn:
    """Columns on each other between smooth, rigid walls, under their weight, on a smooth floor at y = 0.

    Parameters
    ----------
    heights : tuple of float [m]
        From below.
    weights : tuple of float [N/m3]
        Density times gravity.
    materials : tuple of Material

    Notes
    -----
    Uniaxial strain: u_y'(y) = -p(y) / (lambda + 2 mu) with the weight p above. With free sides this is not a solution.
    """

    heights: tuple[float, ...]
    weights: tuple[float, ...]
    materials: tuple[Material, ...]

    def __post_init__(self) -> None:
        for height in self.heights:
            check_positive(height=height)

    def base_pressures(self) -> tuple[float, ...]:
        """Return the pressure [Pa] under each column, from below."""
        block_weights = [weight * height for weight, height in zip(self.weights, self.heights, strict=True)]
        return tuple(sum(block_weights[k:]) for k in range(len(block_weights)))

    def settlements(self) -> tuple[float, ...]:
        """Return how far the top of each column comes down [m], from below."""
        found, total = [], 0.0
        for k, pressure in enumerate(self.base_pressures()):
            mean = pressure - 0.5 * self.weights[k] * self.heights[k]
            total += mean * self.heights[k] / uniaxial_strain_modulus(self.materials[k])
            found.append(total)
        return tuple(found)
