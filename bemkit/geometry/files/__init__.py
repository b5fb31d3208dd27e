"""Bodies from files of other programs: meshes of gmsh and others, DXF and SVG drawings."""
