"""Commissioning of a skin: a person touches marks, and the skin must read them where they are."""
