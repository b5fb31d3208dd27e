"""Rows made by hand."""

from __future__ import annotations

from typing import Any

from bemkit.studies.accuracy.records import ErrorRecord


def row(**changes: Any) -> ErrorRecord:
    """Return a plausible row with some entries changed."""
    values: dict[str, Any] = {
        "discretisation": "linear",
        "map": "Galerkin",
        "meshes": "uniform",
        "solver": "semismooth-newton",
        "size": 40.0,
        "status": "converged",
        "elements": 40,
        "contact_nodes": 11,
        "linear_solves": 4,
        "outer_steps": 3,
        "seconds": 0.1,
        "seconds_mesh": 0.01,
        "seconds_assemble": 0.02,
        "seconds_condense": 0.03,
        "seconds_solve": 0.03,
        "seconds_recover": 0.01,
        "peak_memory": 1e6,
        "estimated_error": 1e-2,
        "energy": 1e-3,
        "sigma_n": 1e-2,
        "sigma_t": 2e-2,
        "displacement": 3e-3,
        "force_normal": 1e-12,
        "force_tangential": 1e-4,
        "transitions": 5e-3,
        "message": "",
    }
    given = values | changes
    return ErrorRecord(**({"unknowns": 2 * given["elements"]} | given))
