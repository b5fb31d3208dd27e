"""One of the paper's examples with GetFEM, for `peers.py`; for an interpreter that has Debian's `python3-getfem`.

    /usr/bin/python3 benchmarks/getfem_peer.py < request.json > answer.json

The request names the example, the `degree`, the mesh lines `x` and `y`, the `points` on the contact side where fields
are wanted, and the `clock`, a function of the module `time`; the answer holds the fields there, resultants, and the
seconds from the mesh to the solution. Displacements of degree p, multipliers of degree p - 1 on the contact side (equal
orders spoil the friction), the integral contact brick by Alart and Curnier with r = E, and MUMPS: the fastest of what
converges.
"""

import json
import sys
import time

import getfem
import numpy as np

EXAMPLES = {
    1: {"E": 1e4, "nu": 0.2, "s": 0.5, "top": (0, "-Heaviside(X(1)-0.5)"), "left": ("Heaviside(X(2)-0.5)", 0)},
    2: {"E": 1e4, "nu": 0.3, "s": 0.1, "top": (0, "-sqr(X(1)*(1-X(1)))"), "left": ("2*sqr(X(2)*(1-X(2)))", 0)},
}
BOTTOM, RIGHT, TOP, LEFT = 1, 2, 3, 4
NORMALS = {BOTTOM: (0, -1), RIGHT: (1, 0), TOP: (0, 1), LEFT: (-1, 0)}


def solve(example, degree, x, y):
    """Return the mesh, the model and the integration method after the solve."""
    data = EXAMPLES[example]
    youngs_modulus, nu = data["E"], data["nu"]
    mesh = getfem.Mesh("cartesian", x, y)
    faces = mesh.outer_faces()
    normals = mesh.normal_of_faces(faces)
    for region, normal in NORMALS.items():
        mesh.set_region(region, faces[:, np.abs(normals - np.reshape(normal, (2, 1))).max(axis=0) < 1e-6])
    displacement, multiplier, scalar = (getfem.MeshFem(mesh, dimension) for dimension in (2, 2, 1))
    displacement.set_fem(getfem.Fem(f"FEM_QK(2,{degree})"))
    multiplier.set_fem(getfem.Fem(f"FEM_QK(2,{degree - 1})"))
    scalar.set_fem(getfem.Fem("FEM_QK(2,1)"))
    rule = getfem.MeshIm(mesh, getfem.Integ(f"IM_GAUSS_PARALLELEPIPED(2,{2 * degree})"))

    model = getfem.Model("real")
    model.add_fem_variable("u", displacement)
    model.add_initialized_data("lame", [youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu))])
    model.add_initialized_data("mu", [youngs_modulus / (2 * (1 + nu))])
    model.add_isotropic_linearized_elasticity_brick(rule, "u", "lame", "mu")
    model.add_normal_Dirichlet_condition_with_multipliers(rule, "u", 1, RIGHT)
    for region, tractions in ((TOP, data["top"]), (LEFT, data["left"])):
        for component, traction in enumerate(tractions, 1):
            if traction:
                model.add_source_term(rule, f"({traction})*Test_u({component})", region)
    model.add_filtered_fem_variable("t", multiplier, BOTTOM)
    model.add_initialized_data("r", [youngs_modulus])
    model.add_initialized_data("s", [data["s"]])
    model.add_initialized_fem_data("distance", scalar, scalar.basic_dof_nodes()[1])
    model.add_integral_contact_with_rigid_obstacle_brick(rule, "u", "t", "distance", "r", "s", BOTTOM, 1)
    _, is_converged = model.solve("max_res", 1e-9, "max_iter", 60, "lsolver", "mumps")
    if not is_converged:
        sys.exit(f"GetFEM did not converge on {len(x) - 1} x {len(y) - 1} cells")
    return mesh, model, rule


def main():
    """Answer one request."""
    getfem.util("trace level", 0)
    request = json.load(sys.stdin)
    now = getattr(time, request["clock"])
    begin = now()
    mesh, model, rule = solve(request["example"], request["degree"], request["x"], request["y"])
    seconds = now() - begin
    points = np.array([request["points"], np.zeros(len(request["points"]))])
    u, t = (model.interpolation(name, points, mesh).reshape(-1, 2) for name in ("u", "t"))
    density = "lame/2*sqr(Trace(Grad_u))+mu/4*Norm_sqr(Grad_u+Grad_u')"
    answer = {
        "seconds": seconds,
        "u_n": (-u[:, 1]).tolist(),
        "u_t": u[:, 0].tolist(),
        "sigma_n": (-t[:, 1]).tolist(),
        "sigma_t": t[:, 0].tolist(),
        "force": float(getfem.asm("generic", rule, 0, "t(1)", BOTTOM, model)),
        "energy": float(getfem.asm("generic", rule, 0, density, -1, model)),
    }
    json.dump(answer, sys.stdout)


if __name__ == "__main__":
    main()
