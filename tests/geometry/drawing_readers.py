"""Readers of our drawings that share no code with the writers: DXF group codes, SVG paths, PDF content streams.

Each returns strokes in mm: the layer, whether it is closed, and its pieces. A piece is a function from 0..1 to a point.
"""

import cmath
import itertools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from xml.etree import ElementTree

Curve = Callable[[float], complex]


@dataclass
class Stroke:
    layer: str
    closed: bool
    curves: list[Curve]


def line(a: complex, b: complex) -> Curve:
    return lambda t: a + (b - a) * t


def arc(centre: complex, a: complex, sweep: float) -> Curve:
    return lambda t: centre + (a - centre) * cmath.exp(1j * sweep * t)


def bulge_arc(a: complex, b: complex, bulge: float) -> Curve:
    """DXF reference: the bulge is the tangent of a quarter of the included angle, negative if clockwise."""
    if bulge == 0.0:
        return line(a, b)
    # evaluated from the chord, because the centre of a slender cone's rim is kilometres away
    half = 2.0 * math.atan(bulge)

    def point(t: float) -> complex:
        return a + (b - a) * cmath.exp(1j * half * (t - 1.0)) * math.sin(half * t) / math.sin(half)

    return point


def bezier(a: complex, p: complex, q: complex, b: complex) -> Curve:
    return lambda t: (1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * p + 3 * t * t * (1 - t) * q + t**3 * b


def dxf_pairs(text: str) -> list[tuple[int, str]]:
    lines = text.splitlines()
    return [(int(code), value.strip()) for code, value in zip(lines[::2], lines[1::2], strict=True)]


def dxf_header(text: str, name: str) -> str:
    pairs = dxf_pairs(text)
    return pairs[pairs.index((9, name)) + 1][1]


def dxf_entities(text: str) -> list[tuple[str, list[tuple[int, str]]]]:
    """Type and group codes of each entity of the model space."""
    pairs = dxf_pairs(text)
    start = pairs.index((2, "ENTITIES"))
    end = pairs.index((0, "ENDSEC"), start)
    found: list[tuple[str, list[tuple[int, str]]]] = []
    for code, value in pairs[start + 1 : end]:
        if code == 0:
            found.append((value, []))
        elif found:
            found[-1][1].append((code, value))
    return found


def dxf_layers(text: str) -> dict[str, int]:
    """Colour of each layer."""
    pairs, layers = dxf_pairs(text), {}
    for i, pair in enumerate(pairs):
        if pair == (0, "LAYER"):
            codes = dict(pairs[i + 1 : i + 12])
            layers[codes[2]] = int(codes[62])
    return layers


def read_dxf(text: str) -> list[Stroke]:
    strokes = []
    for kind, codes in dxf_entities(text):
        single = dict(codes)
        layer = single[8]
        if kind == "LWPOLYLINE":
            points: list[list[float]] = []
            for code, value in codes:
                if code == 10:
                    points.append([float(value), 0.0, 0.0])
                elif code == 20:
                    points[-1][1] = float(value)
                elif code == 42:
                    points[-1][2] = float(value)
            closed = bool(int(single[70]) & 1)
            ring = points + points[:1] if closed else points
            curves = [bulge_arc(complex(a[0], a[1]), complex(b[0], b[1]), a[2]) for a, b in itertools.pairwise(ring)]
            strokes.append(Stroke(layer, closed, curves))
        elif kind == "LINE":
            a, b = complex(float(single[10]), float(single[20])), complex(float(single[11]), float(single[21]))
            strokes.append(Stroke(layer, False, [line(a, b)]))
        elif kind == "ARC":
            centre, radius = complex(float(single[10]), float(single[20])), float(single[40])
            first, last = math.radians(float(single[50])), math.radians(float(single[51]))
            sweep = (last - first) % (2.0 * math.pi)
            strokes.append(Stroke(layer, False, [arc(centre, centre + radius * cmath.exp(1j * first), sweep)]))
        else:
            assert kind == "TEXT", f"an entity that nobody asked for: {kind}"
    return strokes


def dxf_texts(text: str) -> list[str]:
    return [dict(codes)[1] for kind, codes in dxf_entities(text) if kind == "TEXT"]


def svg_arc(a: complex, radius: float, large: int, sweep: int, b: complex) -> Curve:
    """SVG 1.1, appendix F.6.5, for a circle."""
    half = 0.5 * (a - b)
    root = math.sqrt(max(0.0, radius**2 / abs(half) ** 2 - 1.0)) * (-1.0 if large == sweep else 1.0)
    centre = 0.5 * (a + b) + root * complex(half.imag, -half.real)
    turn = cmath.phase((b - centre) / (a - centre))
    if sweep and turn < 0.0:
        turn += 2.0 * math.pi
    if not sweep and turn > 0.0:
        turn -= 2.0 * math.pi
    return arc(centre, a, turn)


def read_svg(text: str) -> list[Stroke]:
    root = ElementTree.fromstring(text)
    width, height = (float(root.get(key, "").removesuffix("mm")) for key in ("width", "height"))
    assert [float(value) for value in root.get("viewBox", "").split()] == [0.0, 0.0, width, height]
    space = "{http://www.w3.org/2000/svg}"
    strokes = []
    for group in root.iter(f"{space}g"):
        for path in group.findall(f"{space}path"):
            words = re.findall(r"[MLACZ]|-?[\d.]+", path.get("d", ""))
            curves: list[Curve] = []
            here = start = 0j
            closed = False
            i = 0

            def point(at: int, words: list[str] = words) -> complex:
                return complex(float(words[at]), height - float(words[at + 1]))

            while i < len(words):
                command = words[i]
                if command == "M":
                    here = start = point(i + 1)
                    i += 3
                elif command == "L":
                    curves.append(line(here, point(i + 1)))
                    here = point(i + 1)
                    i += 3
                elif command == "C":
                    curves.append(bezier(here, point(i + 1), point(i + 3), point(i + 5)))
                    here = point(i + 5)
                    i += 7
                elif command == "A":
                    radius, large, sweep = float(words[i + 1]), int(words[i + 4]), int(words[i + 5])
                    end = point(i + 6)
                    curves.append(svg_arc(here, radius, large, 1 - sweep, end))  # y is turned over
                    here = end
                    i += 8
                else:
                    closed = True
                    assert abs(here - start) < 1e-9, "Z must not draw"
                    i += 1
            strokes.append(Stroke(str(group.get("id")), closed, curves))
    return strokes


def pdf_objects(data: bytes) -> dict[int, str]:
    """Objects by number, found through the cross-reference table."""
    text = data.decode("latin-1")
    start = int(re.findall(r"startxref\s+(\d+)", text)[-1])
    count = int(re.match(r"xref\s+0 (\d+)", text[start:])[1])  # type: ignore[index]
    rows = re.findall(r"(\d{10}) 00000 n", text[start:])
    assert len(rows) == count - 1
    objects = {}
    for number, offset in enumerate(map(int, rows), start=1):
        assert text[offset:].startswith(f"{number} 0 obj"), "the cross-reference table is off"
        objects[number] = text[offset : text.index("endobj", offset)]
    return objects


def read_pdf(data: bytes) -> list[Stroke]:
    """Strokes of the one form XObject, which is the drawing in mm."""
    form = next(body for body in pdf_objects(data).values() if "/Subtype /Form" in body)
    content = form[form.index("stream\n") + 7 : form.index("\nendstream")]
    strokes: list[Stroke] = []
    curves: list[Curve] = []
    here = start = 0j
    layer = ""
    for row in content.splitlines():
        words = row.split()
        numbers = [float(word) for word in words[:-1]] if words[-1] in ("m", "l", "c") else []
        points = [complex(x, y) for x, y in zip(numbers[::2], numbers[1::2], strict=True)]
        if words[-1] == "BDC":
            layer = words[1]
        elif words[-1] == "m":
            here = start = points[0]
            curves = []
        elif words[-1] == "l":
            curves.append(line(here, points[0]))
            here = points[0]
        elif words[-1] == "c":
            curves.append(bezier(here, *points))
            here = points[2]
        elif words[-1] in ("s", "S"):
            assert words[-1] == "S" or abs(here - start) < 1e-9
            strokes.append(Stroke(layer, words[-1] == "s", curves))
    return strokes
