"""Measured profiles as obstacles of a scene: units of their files, and jumps at their seams."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from bemkit.contact.obstacle import Obstacle
from bemkit.contact.rough_profile import Profile, ProfilePoints
from bemkit.errors import ResultWarning
from bemkit.scene.unit_names import UnitNames, amount, check_length_of_file


def check_profiles(obstacles: Mapping[str, Obstacle], units: UnitNames) -> None:
    """Raise InputError if the file of a profile, by the part that touches it, has another unit of length."""
    for part, obstacle in obstacles.items():
        if isinstance(obstacle, Profile):
            check_length_of_file(obstacle.unit, units, f"profile of part {part!r}")


def profile_warnings(obstacles: Mapping[str, Obstacle], units: UnitNames | None) -> Iterator[ResultWarning]:
    """Warn of periodic profiles that jump where their period ends."""
    for part, obstacle in obstacles.items():
        if isinstance(obstacle, Profile | ProfilePoints) and (jump := obstacle.seam_jump):
            profile = obstacle.profile if isinstance(obstacle, Profile) else obstacle
            yield ResultWarning(
                "jump of profile",
                part,
                f"Part {part!r}: the profile jumps by {amount(jump, 'length', units, 3)} at its seam, "
                f"x = {profile.columns[0][0]:.6g}, where its period begins again: give levelling = 'ends', or cut it "
                "where its ends meet.",
                jump,
            )
