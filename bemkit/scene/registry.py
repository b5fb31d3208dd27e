"""The words by which scene files name classes, entry points that add words, and how declared types are written."""

from __future__ import annotations

import inspect
import re
import sys
import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, is_dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType, SimpleNamespace
from typing import Any, Union, get_args, get_origin, get_type_hints

from bemkit.errors import InputError
from bemkit.formulas import closest, shorten


def reference_of(declared: object) -> str:
    """Return the import path of a class, as ``"module:Class"``; for another declared type its text."""
    return f"{getattr(declared, '__module__', '')}:{getattr(declared, '__qualname__', '')}"


@dataclass(frozen=True)
class Registry:
    """Classes of one role and their names in scene files.

    Parameters
    ----------
    role : str
        Role of the classes in messages: "friction law".
    built_in : mapping of str to str
        Name to ``"module:Class"``; a module is imported when its name is first used.
    group : str
        Name of the entry-point group by which installed packages add classes; empty if there is none.
    presets : mapping of str to (str, mapping), optional
        Names of a class with options: the name of the class, and the values of its keys.
    hints : mapping of str to str, optional
        Former names, and their replacements.
    protocol : str, optional
        The protocol of the classes, as ``"module:Class"``; none if nobody can add a class.
    listed : str, optional
        The name of the class that a list of names or tables makes; its only field is a tuple of them.
    """

    role: str
    built_in: Mapping[str, str] = field(repr=False)
    group: str = ""
    presets: Mapping[str, tuple[str, Mapping[str, Any]]] = field(default_factory=dict, repr=False)
    hints: Mapping[str, str] = field(default_factory=dict, repr=False)
    protocol: str = ""
    listed: str = ""

    def holds(self, alternatives: Iterable[object]) -> bool:
        """Whether a type declared by these alternatives plays the role: its protocol, or several classes."""
        names = {reference_of(each) for each in alternatives}
        return names <= {self.protocol, *self.built_in.values()} and (self.protocol in names or len(names) > 1)

    def with_options(self, table: Mapping[str, Any]) -> dict[str, Any]:
        """Return a table in which the word of a preset is that of its class, with its options.

        Raises
        ------
        InputError
            If there are other keys beside such a word.
        """
        word = table.get("kind")
        if not isinstance(word, str) or word not in self.presets:
            return dict(table)
        kind, options = self.presets[word]
        if len(table) > 1:
            keys = ", ".join(key for key in table if key != "kind")
            raise InputError(f"{word!r} has no keys, but {keys} is given: remove it, or write kind = {kind!r}")
        return {"kind": kind, **options}

    def written(self, kind: str, options: Mapping[str, Any]) -> str | dict[str, Any]:
        """Return the word or the table that names a class with options in scene files."""
        for word, preset in self.presets.items():
            if preset == (kind, options):
                return word
        return {"kind": kind, **options} if options else kind

    def __post_init__(self) -> None:
        object.__setattr__(self, "built_in", MappingProxyType(self.built_in))

    def find(self, kind: str) -> type:
        """Return the class that a word names.

        Raises
        ------
        ValueError
            If nothing of that name is built in or installed, listing the known words; or if what is installed under
            the name cannot be imported or is not a dataclass.
        """
        kind = self.presets[kind][0] if kind in self.presets else kind
        if kind in self.built_in:
            return self._load(EntryPoint(kind, self.built_in[kind], self.group))
        installed = self._installed()
        if kind in installed:
            return self._load(installed[kind])
        if kind in self.hints:
            raise InputError(f"the {self.role} {kind!r} {self.hints[kind]}")
        known = self.names()
        hint = closest(kind, known, SYNONYMS)
        raise InputError(f"unknown {self.role} {shorten(kind)}: the known ones are {', '.join(known)}{hint}")

    def names(self) -> tuple[str, ...]:
        """Return all words: the built-in ones, then those that installed packages add."""
        return tuple(dict.fromkeys([*self.presets, *self.built_in, *self._installed()]))

    def kind_of(self, value: object) -> str:
        """Return the word that names the class of a value.

        Raises
        ------
        ValueError
            If the class has no word, so that it cannot be written to a scene file.
        """
        name = reference_of(type(value))
        for kind, reference in self.built_in.items():
            if reference == name:
                return kind
        for kind, point in self._installed().items():
            if kind not in self.built_in and self._load(point) is type(value):
                return kind
        hint = f"register it under the entry-point group '{self.group}'" if self.group else "use a built-in one"
        raise InputError(f"the {self.role} {type(value).__name__} has no name in scene files: {hint}")

    def name_of(self, value: object) -> str:
        """Return the word for a value or its class, or the name of its class if that has no name in scene files."""
        try:
            kind = self.kind_of(value)
        except InputError:
            return type(value).__name__
        presets = (word for word, (name, options) in self.presets.items() if name == kind and options == vars(value))
        return next(presets, kind)

    def _installed(self) -> dict[str, EntryPoint]:
        return {point.name: point for point in entry_points(group=self.group)} if self.group else {}

    def _load(self, point: EntryPoint) -> type:
        try:
            loaded = point.load()
        except (ImportError, AttributeError) as error:
            raise InputError(f"{self.role} '{point.name}' ({point.value}) cannot be loaded: {error}") from error
        if not (isinstance(loaded, type) and is_dataclass(loaded)):
            raise InputError(f"{self.role} '{point.name}' ({point.value}) is not a dataclass: make it one")
        return loaded


SHAPES = Registry(
    "shape",
    {
        "rectangle": "bemkit.geometry.shapes:Rectangle",
        "polygon": "bemkit.geometry.shapes:Polygon",
        "disk": "bemkit.geometry.shapes:Disk",
        "sector": "bemkit.geometry.shapes:Sector",
        "ring": "bemkit.geometry.shapes:Ring",
        "plate-with-hole": "bemkit.geometry.shapes:PlateWithHole",
        "exterior-of": "bemkit.geometry.shapes:ExteriorOf",
        "half-plane": "bemkit.geometry.shapes:ElasticHalfPlane",
        "periodic-half-plane": "bemkit.geometry.shapes:PeriodicHalfPlane",
        "outline": "bemkit.geometry.free_form.drawn:OutlineShape",
        "mesh": "bemkit.geometry.files.shape_file:MeshFile",
        "drawing": "bemkit.geometry.files.shape_file:DrawingFile",
    },
    "bemkit.shapes",
    protocol="bemkit.geometry.shapes:Shape",
)

FILE_KINDS = ("mesh", "drawing", "profile")
"""Shapes and obstacles with the name of a file."""

SIDES = Registry(
    "side",
    {
        "line": "bemkit.geometry.free_form.drawn:LineTo",
        "arc": "bemkit.geometry.free_form.drawn:ArcTo",
        "spline": "bemkit.geometry.free_form.drawn:SplineTo",
        "nurbs": "bemkit.geometry.free_form.drawn:NurbsTo",
    },
    protocol="bemkit.geometry.free_form.drawn:DrawnSide",
)

GRADINGS = Registry(
    "grading",
    {
        "uniform": "bemkit.geometry.meshing.discretise:Uniform",
        "algebraic": "bemkit.geometry.meshing.discretise:Algebraic",
        "geometric": "bemkit.geometry.meshing.discretise:Geometric",
    },
    protocol="bemkit.geometry.meshing.discretise:Grading",
)

CONDITIONS = Registry(
    "condition",
    {
        "clamped": "bemkit.scene.conditions:Clamped",
        "roller": "bemkit.scene.conditions:Roller",
        "displacement": "bemkit.scene.conditions:PrescribedDisplacement",
        "traction": "bemkit.scene.conditions:Traction",
        "pressure": "bemkit.scene.conditions:Pressure",
        "force": "bemkit.scene.conditions:Force",
        "contact": "bemkit.scene.conditions:Contact",
        "free": "bemkit.scene.conditions:Free",
    },
)

COPIES = Registry(
    "rule for copies",
    {
        "grid": "bemkit.scene.copies:GridCopies",
        "circle": "bemkit.scene.copies:CircleCopies",
        "list": "bemkit.scene.copies:ListedCopies",
    },
    protocol="bemkit.scene.copies:Copies",
)

BODY_FORCES = Registry(
    "body force",
    {
        "gravity": "bemkit.scene.body_forces:Gravity",
        "rotation": "bemkit.scene.body_forces:Rotation",
        "heating": "bemkit.scene.body_forces:Heating",
    },
)

OBSTACLES = Registry(
    "obstacle",
    {
        "half-plane": "bemkit.contact.obstacle:RigidHalfPlane",
        "circle": "bemkit.contact.obstacle:RigidCircle",
        "cavity": "bemkit.contact.obstacle:RigidCavity",
        "polygon": "bemkit.contact.polygon:RigidPolygon",
        "spline": "bemkit.contact.spline:RigidSpline",
        "signed-distance": "bemkit.contact.signed_distance:SignedDistance",
        "gap": "bemkit.contact.obstacle:Gap",
        "profile": "bemkit.contact.rough_profile:Profile",
        "profile-points": "bemkit.contact.rough_profile:ProfilePoints",
        "self-affine": "bemkit.contact.rough_profile:SelfAffineProfile",
    },
    "bemkit.obstacles",
    protocol="bemkit.contact.obstacle:Obstacle",
)

LAWS = Registry(
    "friction law",
    {
        "frictionless": "bemkit.contact.laws:Frictionless",
        "tresca": "bemkit.contact.laws:Tresca",
        "coulomb": "bemkit.contact.laws:Coulomb",
        "cohesive-coulomb": "bemkit.contact.further_laws:CohesiveCoulomb",
        "slip-weakening": "bemkit.contact.further_laws:SlipWeakening",
        "rate-strengthening": "bemkit.contact.further_laws:RateStrengthening",
    },
    "bemkit.laws",
    protocol="bemkit.contact.laws:FrictionLaw",
)

RISING = "hp"
"""Word of scene files, instead of a discretisation, for degrees that rise: `MeshOptions.rising_degrees`."""

DISCRETISATIONS = Registry(
    "discretisation",
    {
        "galerkin": "bemkit.scene.discretisation:Galerkin",
        "constant": "bemkit.scene.discretisation:ConstantCollocation",
    },
    "bemkit.discretisations",
    presets={"linear": ("galerkin", {"degree": 1}), "quadratic": ("galerkin", {"degree": 2})},
    hints={RISING: "is a choice for all bodies of a scene: set mesh.rising_degrees = true and mesh.accuracy"},
    protocol="bemkit.scene.discretisation:Discretisation",
)

LINEAR_SOLVERS = Registry(
    "linear solver",
    {
        "automatic": "bemkit.operators.linear_solvers:Automatic",
        "direct": "bemkit.operators.linear_solvers:DenseCholesky",
        "hierarchical": "bemkit.operators.linear_solvers:Hierarchical",
        "matrix-free": "bemkit.operators.linear_solvers:MatrixFree",
    },
    hints={"krylov": "was removed: use 'hierarchical', faster and smaller for constant elements, or 'automatic'"},
    protocol="bemkit.operators.linear_solvers:LinearSolver",
)

SOLVERS = Registry(
    "solver",
    {
        "fallbacks": "bemkit.solvers.fallbacks:Fallbacks",
        "semismooth-newton": "bemkit.solvers.ssn:SemismoothNewton",
        "springs": "bemkit.solvers.fallbacks:Springs",
        "solution-path": "bemkit.solvers.fallbacks:SolutionPath",
        "augmented-lagrangian": "bemkit.solvers.alm:AugmentedLagrangian",
        "fixed-point": "bemkit.solvers.fixed_point:FixedPoint",
        "lemke": "bemkit.solvers.lemke:LemkePivoting",
    },
    "bemkit.solvers",
    protocol="bemkit.solvers.base:ContactSolver",
    listed="fallbacks",
)

REGISTRIES = (
    *(SHAPES, SIDES, GRADINGS, CONDITIONS, COPIES, BODY_FORCES),
    *(OBSTACLES, LAWS, DISCRETISATIONS, LINEAR_SOLVERS, SOLVERS),
)

HEADINGS = {
    "bemkit.scene.conditions:Part": "parts",
    "bemkit.scene.body:Body": "bodies",
    "bemkit.scene.plane_motion:RigidBody": "rigid",
}
"""Classes of which several are in tables headed by their names, and the word before the name."""

_DEFERRED: Mapping[str, str] = MappingProxyType(
    {
        reference.split(":")[1]: reference
        for reference in (
            *(*HEADINGS, COPIES.protocol, "bemkit.scene.plane_motion:FarField", "bemkit.scene.steps:Step"),
            *("bemkit.scene.contacts:ContactPair", "bemkit.scene.contacts:Touching"),
            *("bemkit.scene.body_forces:BodyForce", "bemkit.geometry.symmetry.lines:Symmetry"),
        )
    }
)
"""Types of fields that are imported once a scene has such a field."""

SYNONYMS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        **dict.fromkeys(("e", "young", "young_modulus", "elastic_modulus", "modulus"), ("youngs_modulus",)),
        **dict.fromkeys(("nu", "poisson"), ("poisson_ratio",)),
        **dict.fromkeys(("mu", "friction", "coefficient"), ("friction_coefficient", "coulomb", "law")),
        **dict.fromkeys(("boundary", "supports", "loads", "conditions"), ("parts",)),
        **dict.fromkeys(("n", "number", "size"), ("elements",)),
        **dict.fromkeys(("tolerance", "tol", "error", "eps"), ("accuracy",)),
        **dict.fromkeys(("p", "order"), ("degree",)),
        **{"r": ("radius",), "w": ("width",), "h": ("height",), "centroid": ("centre",), "faces": ("sides",)},
        **dict.fromkeys(("square", "block", "box"), ("rectangle",)),
        **dict.fromkeys(("cylinder", "ball"), ("disk", "circle")),
        **dict.fromkeys(("fixed", "encastre", "held"), ("clamped",)),
        **dict.fromkeys(("symmetric", "sliding", "slider"), ("roller",)),
        **dict.fromkeys(("force", "load", "neumann"), ("traction", "force_y")),
        **dict.fromkeys(("dirichlet", "prescribed"), ("displacement",)),
        **dict.fromkeys(("plane", "floor", "wall", "line"), ("half-plane",)),
        **dict.fromkeys(("ssn", "newton"), ("semismooth-newton",)),
        **dict.fromkeys(("alm", "uzawa"), ("augmented-lagrangian",)),
        **dict.fromkeys(("dense", "cholesky", "lu"), ("direct",)),
    }
)
"""Common synonyms of names and keys."""


def registry_of(declared: Any) -> Registry | None:
    """Return the registry whose words name the classes of a declared type, None if there is none."""
    alternatives = options_of(declared) or (declared,)
    return next((registry for registry in REGISTRIES if registry.holds(alternatives)), None)


def heading_of(declared: Any) -> str:
    """Return the word that heads the tables of the entries of a tuple, each by its name; empty if none does."""
    inner = get_args(declared)
    is_listed = get_origin(declared) is tuple and inner[1:] == (Ellipsis,)
    return HEADINGS.get(reference_of(inner[0]), "") if is_listed else ""


def options_of(declared: Any) -> tuple[Any, ...]:
    """Return the alternatives of a union that a table can hold, empty for other types."""
    if get_origin(declared) not in (Union, types.UnionType):
        return ()
    options = get_args(declared)
    return tuple(option for option in options if option is not type(None) and get_origin(option) is not Callable)


@cache
def type_of_field(owner: type, name: str) -> Any:
    """Return the declared type of a field of a dataclass."""
    declaring = next(parent for parent in owner.__mro__ if name in inspect.get_annotations(parent))
    declared = inspect.get_annotations(declaring)[name]
    words = re.findall(r"\w+", declared) if isinstance(declared, str) else ()
    deferred = {word: EntryPoint(word, _DEFERRED[word], "").load() for word in words if word in _DEFERRED}
    alone = SimpleNamespace(__annotations__={name: declared})  # types of other fields remain unresolved
    return get_type_hints(alone, vars(sys.modules[declaring.__module__]), deferred)[name]


def is_required(entry: Field[Any]) -> bool:
    """Return whether a field of a dataclass has no default value."""
    return entry.default is MISSING and entry.default_factory is MISSING


def default_of(entry: Field[Any]) -> Any:
    """Return the default value of a field that is not required."""
    return entry.default if entry.default_factory is MISSING else entry.default_factory()
