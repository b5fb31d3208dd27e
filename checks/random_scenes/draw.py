"""Draws from a random generator as plain Python values, which scene files can hold, and what is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.scene.scene import Scene
from bemkit.scene.toml import scene_to_toml

T = TypeVar("T")


class Draw(np.random.Generator):
    """numpy's generator with the draws that random scenes are made of."""

    def chance(self, probability: float) -> bool:
        """Return true with a probability."""
        return bool(self.random() < probability)

    def between(self, low: float, high: float) -> float:
        """Return a number that is uniform between two."""
        return float(self.uniform(low, high))

    def decades(self, low: float, high: float) -> float:
        """Return a power of ten whose exponent is uniform between two numbers."""
        return float(10.0 ** self.uniform(low, high))

    def one_of(self, options: Sequence[T]) -> T:
        """Return one of some values, each as likely as the others."""
        return options[int(self.integers(len(options)))]

    def one_by_weight(self, weights: Mapping[T, float]) -> T:
        """Return a key, as likely as its weight says."""
        shares = np.array(list(weights.values()), dtype=float)
        return list(weights)[int(self.choice(len(shares), p=shares / shares.sum()))]

    def some_of(self, options: Sequence[T]) -> tuple[T, ...]:
        """Return at least one of the values, in their order."""
        count = int(self.integers(min(1, len(options)), len(options) + 1))
        chosen = np.sort(self.permutation(len(options))[:count])
        return tuple(options[k] for k in chosen.tolist())

    def direction(self) -> FloatArray:
        """Return a unit vector (2,): down, along an axis, or anywhere."""
        quarter = -0.5 * np.pi
        angles = {quarter: 0.5, quarter * float(self.integers(4)): 0.25, self.between(-np.pi, np.pi): 0.25}
        angle = self.one_by_weight(angles)
        return np.array([np.cos(angle), np.sin(angle)]).round(15)


@dataclass(frozen=True)
class RandomCase:
    """Scenes or assemblies that follow each other in time, mostly a single one, and the numbers they were drawn by."""

    seed: int
    index: int
    scenes: tuple[Scene, ...]

    def files(self) -> dict[str, str]:
        """Return scene files (TOML) by name, one for each scene."""
        kind = "random-assembly" if self.scenes[0].bodies else "random"
        name = f"{kind}-{self.seed}-{self.index}"
        names = [name] if len(self.scenes) == 1 else [f"{name}-step-{k}" for k in range(1, len(self.scenes) + 1)]
        return {f"{each}.toml": scene_to_toml(scene) for each, scene in zip(names, self.scenes, strict=True)}
