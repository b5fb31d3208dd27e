"""Small contact problems without boundary elements, and a checker that shares nothing with the drivers."""

import zlib

import numpy as np

from bemkit.contact.body import ContactState, LinearBody
from bemkit.contact.contact_nodes import ContactNodes, approaches, contact_frame, nodes_on, opened
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.direct_body import DirectBody, WholeBody
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.geometry.local_values import dof_weights
from bemkit.geometry.spaces import dof_points
from bemkit.operators.steklov_poincare.nodal_conditions import supported


def contact_along_normals(space, elements):
    """Return the nodes of elements (m,), in order along the boundary, with contact along the body's normals."""
    nodes, normals = nodes_on(space, elements)
    weights = dof_weights(space, elements)[nodes]
    return ContactNodes(nodes, dof_points(space)[nodes], contact_frame(normals), weights)


def contact_conditions(space, supports, candidates):
    """Return the conditions of all nodes under supports, and those of the candidates that can touch."""
    conditions = supported(space, supports)
    contact = candidates.take(approaches(candidates.nodes, candidates.directions, conditions))
    return opened(conditions, contact), contact


def condense(elastic, supports, candidates, force):
    """Reduce an elastic body with supports to those of the candidates that can touch."""
    conditions, contact = contact_conditions(elastic.displacement_space, supports, candidates)
    return condensed_body(elastic, conditions, contact, force)


def condensed_body(elastic, conditions, contact, force):
    """Reduce a body to contact nodes and the conditions that `contact_conditions` has found for them."""
    condensed = elastic.condense(conditions, force)
    whole = WholeBody.of(elastic.displacement_space, condensed, conditions, force)
    return DirectBody.of(whole, contact, elastic.material)


def block_stiffness(n, poisson_ratio):
    """Stiffness and coordinates of a unit square of n x n bilinear finite elements, E = 1, plane strain."""
    lame = poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))
    shear = 0.5 / (1 + poisson_ratio)
    elasticity = np.array([[lame + 2 * shear, lame, 0], [lame, lame + 2 * shear, 0], [0, 0, shear]])
    element = np.zeros((8, 8))
    for a in (-1 / np.sqrt(3), 1 / np.sqrt(3)):
        for b in (-1 / np.sqrt(3), 1 / np.sqrt(3)):
            strain = np.zeros((3, 8))
            strain[0, 0::2] = strain[2, 1::2] = np.array([b - 1, 1 - b, 1 + b, -1 - b]) / 2
            strain[1, 1::2] = strain[2, 0::2] = np.array([a - 1, -1 - a, 1 + a, 1 - a]) / 2
            element += strain.T @ elasticity @ strain / 4
    size = 2 * (n + 1) ** 2
    stiffness = np.zeros((size, size))
    for row in range(n):
        for column in range(n):
            first = row * (n + 1) + column
            corners = np.array([first, first + 1, first + n + 2, first + n + 1])
            dofs = np.stack([2 * corners, 2 * corners + 1], axis=1).ravel()
            stiffness[np.ix_(dofs, dofs)] += element
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    return stiffness, np.stack([x.ravel(), y.ravel()], axis=1)


def block_body(n=12, *, press=1.0, push=1.0, is_held_sideways=True, poisson_ratio=0.2):
    """Unit block standing on its bottom, pressed on the right half of its top, pushed on its left side's upper half.

    Held sideways by a roller on its right side (the paper's Example 1) or free. The body floats vertically.
    """
    stiffness, x = block_stiffness(n, poisson_ratio)
    load = np.zeros(len(stiffness))
    for side, along, dof, pressure in ((1, 0, 1, -press), (0, 1, 0, push)):
        where = 1.0 if side == 1 else 0.0
        nodes = np.flatnonzero(np.isclose(x[:, side], where) & (x[:, along] > 0.5 - 1e-9))
        share = np.where(np.isclose(x[nodes, along], 0.5) | np.isclose(x[nodes, along], 1.0), 0.5, 1.0) / n
        load[2 * nodes + dof] += pressure * share
    held = 2 * np.flatnonzero(np.isclose(x[:, 0], 1.0)) if is_held_sideways else np.zeros(0, dtype=int)
    contact = np.flatnonzero(np.isclose(x[:, 1], 0.0))[: n if is_held_sideways else n + 1]
    dofs = np.stack([2 * contact + 1, 2 * contact], axis=1).ravel()
    sign = np.tile([-1.0, 1.0], len(contact))  # the outward normal points down, the tangent to the right
    inner = np.setdiff1d(np.arange(len(load)), np.concatenate([dofs, held]))
    right_sides = np.column_stack([stiffness[np.ix_(inner, dofs)], load[inner]])
    solved = np.linalg.solve(stiffness[np.ix_(inner, inner)], right_sides)
    condensed = stiffness[np.ix_(dofs, dofs)] - stiffness[np.ix_(dofs, inner)] @ solved[:, :-1]
    condensed = sign[:, None] * condensed * sign
    weights = np.full(len(contact), 1.0 / n)
    weights[0] /= 2
    zero, one = np.zeros(len(contact)), np.ones(len(contact))
    motions = [np.stack([one, zero], axis=1)]
    if not is_held_sideways:
        weights[-1] /= 2
        motions += [np.stack([zero, one], axis=1), np.stack([x[contact, 0] - 0.5, zero], axis=1)]
    condensed_load = sign * (load[dofs] - stiffness[np.ix_(dofs, inner)] @ solved[:, -1])
    return DenseBody((condensed + condensed.T) / 2, condensed_load, weights, np.array(motions))


class Inexact(LinearBody):
    """A body whose responses are those of another one but for a relative error, and which counts them."""

    def __init__(self, body, error=0.0, *, accuracy=1e-14, responses_are_expensive=False):
        self.body, self.error, self.accuracy, self.responses_are_expensive = (
            body,
            error,
            accuracy,
            responses_are_expensive,
        )
        self.weights, self.n_responses = body.weights, 0

    @property
    def stiffness_scale(self):
        return self.body.stiffness_scale

    def respond(self, conditions):
        self.n_responses += 1
        exact = self.body.respond(conditions)
        seed = zlib.crc32(exact.displacement.tobytes() + exact.traction.tobytes())
        noise = self.error * np.random.default_rng(seed).uniform(-1.0, 1.0, (2, *exact.traction.shape))
        displacement, traction = np.abs(exact.displacement).max(), np.abs(exact.traction).max()
        return ContactState(exact.displacement + displacement * noise[0], exact.traction + traction * noise[1])

    def rigid_motions(self):
        return self.body.rigid_motions()

    def rigid_load(self):
        return self.body.rigid_load()


def block_problem(law, n=12, **options):
    body = block_body(n, **options)
    return ContactProblem(body, np.zeros(body.n_contact), law)


def random_body(random, n_contact, condition=10.0):
    """Held body with a random symmetric stiffness of about the given condition number."""
    size = 2 * n_contact
    basis = np.linalg.qr(random.normal(size=(size, size)))[0]
    stiffness = basis @ np.diag(condition ** random.uniform(0.0, 1.0, size)) @ basis.T
    load = random.normal(size=size) * condition
    load[0::2] += random.uniform(-1.0, 1.0) * condition
    return DenseBody((stiffness + stiffness.T) / 2, load, random.uniform(0.5, 1.5, n_contact))


def random_problem(seed, *, friction_share=0.9, n_most=40, condition=10.0):
    """Random Coulomb problem with friction_share times the friction up to which the solution is unique.

    Two solutions differ by ``K d . d <= |bound difference| |d_t| <= s |K d| |d|`` in weighted nodal forces, so that
    ``s < 1/cond(K)`` makes them equal.
    """
    random = np.random.default_rng(seed)
    n_contact = int(random.integers(1, n_most + 1))
    body = random_body(random, n_contact, condition)
    gap = random.normal(size=n_contact) * random.choice([0.0, 0.1, 1.0])
    return ContactProblem(body, gap, Coulomb(friction_share / np.linalg.cond(body.stiffness)))


def hard_problem(seed, *, n_most=5, condition=100.0, friction_coefficient=2.0):
    """Random problem with friction far beyond uniqueness; most drivers fail on some of them."""
    random = np.random.default_rng(seed)
    body = random_body(random, int(random.integers(1, n_most + 1)), condition)
    return ContactProblem(body, np.zeros(body.n_contact), Coulomb(friction_coefficient))


def assert_solves(problem, state, friction_coefficient, tolerance=1e-8):
    """Check conditions (6) to (8) and ``weights t = stiffness u - load`` node by node, straight from the arrays."""
    body = problem.body
    u_n, u_t = np.asarray(state.displacement).T
    t_n, t_t = np.asarray(state.traction).T
    force = np.stack([body.weights * t_n, body.weights * t_t], axis=1).ravel()
    terms = np.abs(body.stiffness * np.asarray(state.displacement).ravel()).max()
    size = max(terms, np.abs(body.load).max(), np.abs(force).max())
    residual = body.stiffness @ np.asarray(state.displacement).ravel() - body.load - force
    assert np.abs(residual).max() <= tolerance * size
    traction = max(np.abs(state.traction).max(), np.abs(body.load).max() / body.weights.max())
    length = max(np.abs(state.displacement).max(), traction * body.weights.max() / np.linalg.norm(body.stiffness, 2))
    slip = u_t - problem.slip_origin
    coefficient = np.broadcast_to(friction_coefficient, u_n.shape)
    for node in range(len(u_n)):
        assert u_n[node] - problem.gap[node] <= tolerance * length
        assert t_n[node] <= tolerance * traction
        assert u_n[node] >= problem.gap[node] - tolerance * length or abs(t_n[node]) <= tolerance * traction
        most = coefficient[node] * abs(t_n[node])
        assert abs(t_t[node]) <= most + tolerance * traction
        if abs(slip[node]) > tolerance * length:
            assert abs(t_t[node] + most * np.sign(slip[node])) <= tolerance * traction
