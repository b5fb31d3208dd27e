"""A half-plane with thousands of elements as an elastic map, with equations compressed over a tree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.counts import OperationCounts
from bemkit.operators.half_plane.cost import strip_cost
from bemkit.operators.half_plane.elasticity import HalfPlaneElasticity
from bemkit.operators.half_plane.equations import HalfPlaneEquations, StripView, potential_of
from bemkit.operators.half_plane.far_motion import FarMotion
from bemkit.operators.hierarchy.factor import Factor
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.steklov_poincare.cost import BodyCase, BodyCost

_LEAF = 96
"""Elements of a leaf."""


@dataclass(frozen=True, eq=False)
class LargeHalfPlane(HalfPlaneElasticity):
    """Elasticity of a half-plane with thousands of elements on its surface; see `SurfaceElasticity`.

    Parameters
    ----------
    tolerance : float
        Relative tolerance of the compression.
    """

    tolerance: float = 2e-11

    @property
    def work(self) -> OperationCounts:
        """Return no counts, because no matrix is formed."""
        return OperationCounts()

    def cost(self, case: BodyCase) -> BodyCost:
        """Return memory and time of the map."""
        return strip_cost(case, has_tree=True)

    @cached_property
    def factor(self) -> Factor:
        """The compressed equations with the load-controlled motions as their border."""
        far_motion = self.far_motion
        at_elements = far_motion.motions_at(self.mesh.centres)[:, :, list(far_motion.load_controlled)]
        motions = np.einsum("c,ncm->mn", self.axes, at_elements)
        equations = HalfPlaneEquations(self.nodes, self.material, motions)
        points = np.stack([equations.points.real, np.zeros(self.mesh.n_elements)], axis=1)
        return Factor(equations, ClusterTree.of(points, _LEAF), self.tolerance, level_view=StripView)

    def with_far_motion(self, far_motion: FarMotion) -> Self:
        """Return the half-plane under another far motion; keep the factor if the same motions are load-controlled."""
        other, before = super().with_far_motion(far_motion), self.far_motion
        is_same_border = (far_motion.load_controlled, far_motion.centre) == (before.load_controlled, before.centre)
        if is_same_border and "factor" in self.__dict__:
            other.__dict__["factor"] = self.factor
        return other

    def _along(self, force: FloatArray) -> FloatArray:
        equations = self.factor.equations
        assert isinstance(equations, HalfPlaneEquations)
        return np.asarray(equations.along * potential_of(self.factor.compression, force))
