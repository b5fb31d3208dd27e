"""The load under which an assembly of bodies collapses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bemkit.contact.solvability import largest_factor
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.model.assembled.model import build_assembled_model
from bemkit.model.assembled.prepared import prepare_assembly_steps
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.assembly import Assembly
from bemkit.scene.load_history import load_steps, with_scaled_loads


def largest_load_factor(assembly: Assembly, *, meshes: Mapping[str, BoundaryMesh] | None = None) -> float:
    """Return the largest load factor under which contact tractions can balance the loads of an assembly.

    Parameters
    ----------
    assembly : Assembly
        Its loads and body forces are those of the factor one; body forces that are constant have none. Its own load
        factors play no part.
    meshes : mapping of str to BoundaryMesh, optional
        As for `bemkit.runs.assembly.run_assembly`.

    Returns
    -------
    float
        Infinite if supports and contacts hold any multiple.

    Raises
    ------
    UnsolvableSceneError
        If no factor at all leaves a load that can be balanced.

    Notes
    -----
    The static theorem of limit analysis on the contact nodes, by one linear programme: nothing is said of stresses
    inside the bodies. Of Coulomb friction this is a bound from above, see `bemkit.contact.solvability.largest_factor`.
    """
    assembly = load_steps(replace(assembly, load_factors=(1.0,)))[-1]
    loaded, constant = prepare_assembly_steps([assembly, with_scaled_loads(assembly, 0.0)], meshes)
    if not loaded.n_contact:
        raise InputError("no two bodies are in contact: list contacts")
    with blas_threads_for(loaded.largest_matrix):
        model = build_assembled_model(loaded)
        at_rest = model.under(constant)
        growing = model.body.rigid_load() - at_rest.body.rigid_load()
        factor = largest_factor(at_rest.problem, growing)
    if factor is None:
        raise UnsolvableSceneError("no contact tractions can balance the constant load, at any load factor")
    return factor
