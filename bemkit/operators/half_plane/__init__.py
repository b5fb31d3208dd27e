"""Elastic half-planes, known by what tractions on their surface displace there: no operator but this one."""
