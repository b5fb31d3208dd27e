"""Whether a scene is symmetric about a line: its shape, conditions, loads, obstacles and friction laws.

Points of the boundary are reflected: each image must lie on the boundary of the whole body, and the conditions there
must be the images of those at the point. Friction is symmetric where its bound is: slip is reflected with the body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import measure_contact
from bemkit.errors import GeometryError, InputError, format_point
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.division import divide
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.scene.body_forces import Heating
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import Clamped, Contact, Load, Part, PrescribedDisplacement, Roller

_PER_PIECE = 4
"""Elements of each piece of the boundary in the coarse mesh on which images are looked for."""
_PLACES = np.array([-0.9, -0.37, 0.31, 0.8])
"""Local coordinates of the points compared on each element: asymmetric, and away from its ends, where parts change."""
_TOLERANCE = 1e-9
"""Relative difference of equal values: round-off and omitted digits."""
_PRESSURES = (1e-6, 1e-4, 1e-2, 1.0)
"""Pressures, in units of E', at which friction bounds are compared."""


class AsymmetricSceneError(GeometryError):
    """A scene that is not symmetric about a line it names."""


def check_symmetry(scene: BodyScene, mesh: BoundaryMesh) -> None:
    """Raise unless a scene is symmetric about the lines it names, and so is its mesh.

    Parameters
    ----------
    scene : BodyScene
    mesh : BoundaryMesh
        Of one side of the lines; conditions are compared on all its elements.

    Raises
    ------
    AsymmetricSceneError
        Naming the first condition or point without an image, and both places.
    """
    if scene.symmetry != mesh.symmetry:
        raise AsymmetricSceneError(
            f"symmetry: the scene has {scene.symmetry or 'none'}, the mesh {mesh.symmetry or 'none'}: give both the "
            "same, or let the scene build its mesh"
        )
    if scene.symmetry is None:
        return
    lines = scene.symmetry.lines
    whole = _Whole.of(scene)
    for samples in (_samples(whole.mesh), _samples(mesh)):
        for line in lines:
            difference = whole.difference(line, samples)
            if difference is not None:
                raise AsymmetricSceneError(
                    f"symmetry: the scene is not symmetric about {line}: {difference}: correct the scene or the line, "
                    "or remove the symmetry"
                )


def check_law_symmetry(name: str, law: FrictionLaw, points: FloatArray, symmetry: Symmetry, modulus: float) -> None:
    """Raise unless the friction law of a contact is the same at points (n, 2) and at their images.

    Raises
    ------
    AsymmetricSceneError
    """
    for signs in symmetry.images[1:]:
        images = symmetry.reflected(points, signs)
        bounds, image_bounds = (_bounds(law, places, modulus) for places in (points, images))
        difference = _first_difference(bounds, image_bounds, (points, images), signs)
        if difference is not None:
            raise AsymmetricSceneError(
                f"contact {name!r}: its law is not symmetric about {symmetry}: {difference}: correct it, or leave the "
                "symmetry out"
            )


def find_symmetry(scene: BodyScene) -> Symmetry | None:
    """Find the lines through the middle of a body, along x and y, about which a scene is symmetric.

    Returns
    -------
    Symmetry or None
        A proposal: a few points of each piece of the boundary are compared, `check_symmetry` compares all elements.
        None if there is no such line, or a formula cannot be evaluated.
    """
    outline = scene.shape.outline()
    if outline.is_exterior:
        return None
    try:
        whole = _Whole.of(scene)
        samples = _samples(whole.mesh)
        x, y = whole.mesh.centre.tolist()
        has_x, has_y = (whole.difference(line, samples) is None for line in (Symmetry(x=x), Symmetry(y=y)))
    except InputError:  # the error of preparing the scene explains it better
        return None
    return Symmetry(x if has_x else None, y if has_y else None) if has_x or has_y else None


@dataclass(frozen=True, eq=False)
class _Samples:
    """Points of a boundary (n, 2), the outward normals there, and the part of each, "" for free boundary."""

    points: FloatArray
    normals: FloatArray
    parts: tuple[str, ...]

    def take(self, rows: IntArray) -> _Samples:
        return _Samples(self.points[rows], self.normals[rows], tuple(self.parts[row] for row in rows.tolist()))


def _samples(mesh: BoundaryMesh) -> _Samples:
    elements = np.arange(mesh.n_elements)
    names = _part_names(mesh)
    return _Samples(
        mesh.points(elements, _PLACES).reshape(-1, 2),
        mesh.normals_at(elements, _PLACES).reshape(-1, 2),
        tuple(names[element] for element in np.repeat(elements, _PLACES.size).tolist()),
    )


def _part_names(mesh: BoundaryMesh) -> list[str]:
    names = [""] * mesh.n_elements
    for name, members in mesh.parts.items():
        for element in members.tolist():
            names[element] = name
    return names


@dataclass(frozen=True, eq=False)
class _Whole:
    """A scene with a coarse mesh of its whole body."""

    scene: BodyScene
    mesh: BoundaryMesh

    @classmethod
    def of(cls, scene: BodyScene) -> _Whole:
        division = divide(scene.shape.outline(), scene.selections)
        positions = np.linspace(0.0, 1.0, _PER_PIECE + 1)
        return cls(scene, division.mesh([piece.at(positions) for piece in division.pieces]))

    def difference(self, line: Symmetry, samples: _Samples) -> str | None:
        """Describe a difference from symmetry about a line; None if there is none."""
        from bemkit.geometry.proximity.location import Locator  # only scenes with a symmetry need it

        signs = line.images[1]
        points = line.reflected(samples.points, signs)
        location = Locator(self.mesh).locate(points)
        k = int(np.argmax(location.distance))
        if location.distance[k] > _TOLERANCE * self.mesh.diameter:
            return (
                f"the image {format_point(points[k])} of the boundary point {format_point(samples.points[k])} lies "
                f"{location.distance[k]:.3g} away from the boundary"
            )
        inside = _inside(self.scene, samples.points), _inside(self.scene, points)
        difference = _first_difference(*inside, (samples.points, points), signs)
        if difference is not None:
            return difference
        names = _part_names(self.mesh)
        images = _Samples(points, signs * samples.normals, tuple(names[e] for e in location.element.tolist()))
        pairs = list(zip(samples.parts, images.parts, strict=True))
        for pair in dict.fromkeys(pairs):
            rows = np.flatnonzero([other == pair for other in pairs])
            difference = self._compare(samples.take(rows), images.take(rows), signs)
            if difference is not None:
                return difference
        return None

    def _compare(self, samples: _Samples, images: _Samples, signs: FloatArray) -> str | None:
        """Compare the conditions at points of one part with those at their images, which all lie in one part."""
        parts = {part.name: part for part in self.scene.parts}
        kind, values = _acting(self.scene, parts.get(samples.parts[0]), samples)
        image_kind, image_values = _acting(self.scene, parts.get(images.parts[0]), images)
        places = (format_point(samples.points[0]), format_point(images.points[0]))
        if kind != image_kind:
            return f"the boundary is {kind} at {places[0]} and {image_kind} at its image {places[1]}"
        points = (samples.points, images.points)
        return _first_difference(values, image_values, points, signs, gap_size=self.mesh.diameter)


def _first_difference(
    values: Mapping[str, FloatArray],
    image_values: Mapping[str, FloatArray],
    places: tuple[FloatArray, FloatArray],
    signs: FloatArray,
    gap_size: float = 0.0,
) -> str | None:
    """Describe the first difference of values (n, 1), or vectors (n, 2), at points from their images, or None."""
    points, images = places
    for name, at_points in values.items():
        at_images = image_values[name]
        expected = at_points * signs if at_points.shape[1] == 2 else at_points
        size = max(_largest(at_points), _largest(at_images), gap_size if name == "gap" else 0.0)
        same = expected == at_images  # infinite gaps
        difference = np.abs(np.where(same, 0.0, expected) - np.where(same, 0.0, at_images)).max(axis=1)
        k = int(np.argmax(difference))
        if not difference[k] <= _TOLERANCE * size:
            return (
                f"the {name} is {_text(at_points[k])} at {format_point(points[k])} and {_text(at_images[k])} "
                f"at its image {format_point(images[k])}"
            )
    return None


def _inside(scene: BodyScene, points: FloatArray) -> dict[str, FloatArray]:
    """Return body force (n, 2) and thermal strain (n, 1), which is harmonic: its boundary values determine it."""
    force, strain = np.zeros_like(points), np.zeros((len(points), 1))
    for body_force in scene.body_forces:
        if isinstance(body_force, Heating):
            strain += body_force.strain_at(points)[:, None]
        else:
            force += body_force.force_at(points)
    return {"body force": force, "thermal strain": strain}


def _acting(scene: BodyScene, part: Part | None, samples: _Samples) -> tuple[str, dict[str, FloatArray]]:
    """Return the kind of condition in a part and its values (n, 1), or (n, 2) for vectors, by name."""
    points, normals = samples.points, samples.normals
    match None if part is None else part.condition:
        case Contact(obstacle=obstacle) if part is not None:
            bounds = _bounds(scene.laws[part.name], points, scene.material.plane_modulus)
            gap, direction = measure_contact(obstacle, points, normals)
            return "in contact", {"gap": gap[:, None], "direction of contact": direction, **bounds}
        case Load() as load:
            return "free or loaded", {"traction": load.at(points, normals)}
        case PrescribedDisplacement() as motion:
            axes = " and ".join(name for name, is_given in zip("xy", motion.is_prescribed, strict=True) if is_given)
            return f"displaced along {axes}", {"displacement": motion.at(points)}
        case Clamped():
            return "clamped", {}
        case Roller():
            return "on rollers", {}
    return "free or loaded", {"traction": np.zeros_like(points)}


def _bounds(law: FrictionLaw, points: FloatArray, modulus: float) -> dict[str, FloatArray]:
    """Return the bounds (n, 1) of a law at points and some pressures, by name."""
    at_points = law.at(points)
    pressures = [np.full(len(points), -p * modulus) for p in _PRESSURES]
    return {f"friction bound at the pressure {-p[0]:.3g}": at_points.bound(p)[:, None] for p in pressures}


def _largest(values: FloatArray) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def _text(values: FloatArray) -> str:
    return format_point(values) if len(values) == 2 else f"{values[0]:.9g}"
