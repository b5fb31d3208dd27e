"""Elastic half-planes, known by what tractions on their surface displace there: no operator but this one."""

from bemkit.operators.half_plane.maps import half_plane_map as half_plane_map
from bemkit.operators.half_plane.maps import half_plane_needs as half_plane_needs
