"""Motion of a half-plane far away: prescribed, or controlled by loads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray, blended
from bemkit.operators.rigid_modes import rigid_motions


@dataclass(frozen=True)
class FarMotion:
    """Far motion of a half-plane along x, along y and as a rotation; each is prescribed or load-controlled.

    Parameters
    ----------
    load_controlled : tuple of int
        Load-controlled motions: 0 along x, 1 along y, 2 the rotation.
    motion : tuple of float [m, m, rad]
        Prescribed motions; zero for load-controlled ones.
    load : tuple of float [N/m, N/m, N m/m]
        Loads on the half-plane; zero for prescribed motions.
    centre : tuple of float [m]
        Centre of rotation and strain, and point of action of the forces.
    strain : float [-]
        Uniform strain of the half-plane along its surface; it causes no tractions on the surface.
    """

    load_controlled: tuple[int, ...] = ()
    motion: tuple[float, float, float] = (0.0, 0.0, 0.0)
    load: tuple[float, float, float] = (0.0, 0.0, 0.0)
    centre: tuple[float, float] = (0.0, 0.0)
    strain: float = 0.0

    def blended(self, other: FarMotion, share: float) -> FarMotion:
        """Return the interpolation (1 - share) self + share other."""
        pairs = ((self.motion, other.motion), (self.load, other.load))
        motion, load = (blended(np.array(start), np.array(end), share).tolist() for start, end in pairs)
        strain = (1.0 - share) * self.strain + share * other.strain
        return replace(other, motion=tuple(motion), load=tuple(load), strain=strain)

    def motions_at(self, points: FloatArray) -> FloatArray:
        """Return the displacements (n, 2, 3) of points (n, 2) [m] under the three unit motions."""
        return rigid_motions(points, np.array(self.centre), 1.0)
