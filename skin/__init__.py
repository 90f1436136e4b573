"""The sensor: wire format, sources, decoding, detection and the electric field. May import geometry."""

if __name__ != "coneskin.skin":
    raise ImportError("import coneskin.skin: the folder skin/ is a part of the package coneskin")
