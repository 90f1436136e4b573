"""Geometry of cones, flat sectors, poses and meshes; of coneskin it imports only errors and arrays."""

if __name__ != "coneskin.geometry":
    raise ImportError("import coneskin.geometry: the folder geometry/ is a part of the package coneskin")
