"""Shapes: cones, their flat sectors, poses, meshes. Imports nothing else of coneskin but its errors."""

if __name__ != "coneskin.geometry":
    raise ImportError("import coneskin.geometry: the folder geometry/ is a part of the package coneskin")
