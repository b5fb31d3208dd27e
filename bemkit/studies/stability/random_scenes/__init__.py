"""Random scenes: wide enough to meet what nobody thought of, each a pure function of two whole numbers."""

from bemkit.studies.stability.random_scenes.draw import RandomCase as RandomCase
from bemkit.studies.stability.random_scenes.scenes import random_case as random_case
