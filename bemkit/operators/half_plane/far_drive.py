"""How a half-plane moves far away: by given motions, or driven by forces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray, blended
from bemkit.operators.rigid_modes import rigid_motions


@dataclass(frozen=True)
class FarMotion:
    """Motion of a half-plane far away along x, along y and as a turn: given, or driven by a load.

    Parameters
    ----------
    driven : tuple of int
        Which of the three motions (0, 1, 2) loads drive.
    motion : tuple of float [m, m, rad]
        Zero where driven.
    load : tuple of float [N/m, N/m, N m/m]
        On the half-plane; zero where not driven.
    centre : tuple of float [m]
        About which it turns and is strained, and where its forces act.
    strain : float [-]
        Along the surface, of the whole half-plane; no traction acts on the surface then.
    """

    driven: tuple[int, ...] = ()
    motion: tuple[float, float, float] = (0.0, 0.0, 0.0)
    load: tuple[float, float, float] = (0.0, 0.0, 0.0)
    centre: tuple[float, float] = (0.0, 0.0)
    strain: float = 0.0

    def blended(self, other: FarMotion, share: float) -> FarMotion:
        """Return the drive a share of the way to another one."""
        pairs = ((self.motion, other.motion), (self.load, other.load))
        motion, load = (blended(np.array(one), np.array(two), share).tolist() for one, two in pairs)
        strain = (1.0 - share) * self.strain + share * other.strain
        return replace(other, motion=tuple(motion), load=tuple(load), strain=strain)

    def motions_at(self, points: FloatArray) -> FloatArray:
        """Return the displacements (n, 2, 3) of points (n, 2) [m] by the three unit motions."""
        return rigid_motions(points, np.array(self.centre), 1.0)
