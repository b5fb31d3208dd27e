"""Random assemblies of several bodies, each a pure function of two whole numbers."""

from checks.random_assemblies.assemblies import random_assembly as random_assembly
