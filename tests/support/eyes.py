"""Eyes with all cones and without one kind, and how well they tell two colors apart."""

#: what an eye without one kind of cone sees of linear red, green and blue: Machado, Oliveira, Fernandes 2009
EYES = {
    "normal": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "protan": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "deutan": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
}


def luminance(colour: tuple[int, ...], eye: str) -> float:
    """Relative luminance of a colour to an eye (WCAG 2.2)."""
    linear = [c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in colour]
    seen = [min(1.0, max(0.0, sum(a * b for a, b in zip(row, linear, strict=True)))) for row in EYES[eye]]
    return sum(a * b for a, b in zip((0.2126, 0.7152, 0.0722), seen, strict=True))


def contrast(first: tuple[int, ...], second: tuple[int, ...], eye: str) -> float:
    """Ratio of contrast of two colours, at least 1 (WCAG 2.2)."""
    low, high = sorted((luminance(first, eye), luminance(second, eye)))
    return (high + 0.05) / (low + 0.05)
