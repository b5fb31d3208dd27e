"""Random scenes: wide enough to meet what nobody thought of, each a pure function of two whole numbers."""

from checks.random_scenes.draw import RandomCase as RandomCase
from checks.random_scenes.scenes import random_case as random_case
