"""Measured profiles as obstacles of a scene: units of their files, and jumps at their seams."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from bemkit.contact.rough_profile import Profile, ProfilePoints
from bemkit.errors import ResultWarning
from bemkit.scene.conditions import Contact, Part
from bemkit.scene.unit_names import UnitNames, amount, check_length_of_file


def check_profiles(parts: Sequence[Part], units: UnitNames) -> None:
    """Raise InputError if the file of a profile states another unit of length than its scene."""
    for part in parts:
        if isinstance(part.condition, Contact) and isinstance(profile := part.condition.obstacle, Profile):
            check_length_of_file(profile.unit, units, f"profile of part {part.name!r}")


def profile_warnings(parts: Sequence[Part], units: UnitNames | None) -> Iterator[ResultWarning]:
    """Warn of periodic profiles that jump where their period ends."""
    for part in parts:
        obstacle = part.condition.obstacle if isinstance(part.condition, Contact) else None
        if isinstance(obstacle, Profile | ProfilePoints) and (jump := obstacle.seam_jump):
            profile = obstacle.profile if isinstance(obstacle, Profile) else obstacle
            yield ResultWarning(
                "jump of profile",
                part.name,
                f"Part {part.name!r}: the profile jumps by {amount(jump, 'length', units, 3)} at its seam, "
                f"x = {profile.columns[0][0]:.6g}, where its period begins again: give levelling = 'ends', or cut it "
                "where its ends meet.",
                jump,
            )
