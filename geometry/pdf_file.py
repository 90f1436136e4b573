"""The frame of a PDF file: objects, pages, cross-reference table."""

from __future__ import annotations

__all__ = ["PdfFile", "number"]


def number(value: float) -> str:
    """A number to 1e-5 of its unit, without an exponent, which PDF does not know."""
    text = f"{value:.5f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


class PdfFile:
    """Objects that are collected and written at the end (PDF 1.5, ISO 32000-1 section 7.5)."""

    def __init__(self) -> None:
        self._objects: list[str] = ["", ""]  # 1: catalogue, 2: page tree
        self._pages: list[int] = []

    def add(self, body: str) -> int:
        """Add an object; returns its number."""
        self._objects.append(body)
        return len(self._objects)

    def add_stream(self, data: str, entries: str = "") -> int:
        """Add a stream of ASCII with more entries for its dictionary; returns its number."""
        return self.add(f"<< {entries} /Length {len(data)} >>\nstream\n{data}\nendstream")

    def add_page(self, entries: str) -> None:
        """Add a page with its entries."""
        self._pages.append(self.add(f"<< /Type /Page /Parent 2 0 R {entries} >>"))

    def finish(self, entries: str, title: str) -> bytes:
        """The file, with entries for the catalogue and a title."""
        safe = title.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
        info = self.add(f"<< /Title ({safe}) /Producer (coneskin) >>")
        kids = " ".join(f"{page} 0 R" for page in self._pages)
        self._objects[0] = f"<< /Type /Catalog /Pages 2 0 R {entries} >>"
        self._objects[1] = f"<< /Type /Pages /Kids [{kids}] /Count {len(self._pages)} >>"
        # four bytes above 127 tell transfer programs that the file is binary
        data, starts = bytearray(b"%PDF-1.5\n%\xe2\xe3\xcf\xd3\n"), []
        for index, body in enumerate(self._objects, start=1):
            starts.append(len(data))
            data += f"{index} 0 obj\n{body}\nendobj\n".encode("ascii", "replace")
        table = len(data)
        data += f"xref\n0 {len(starts) + 1}\n0000000000 65535 f \n".encode()
        data += b"".join(b"%010d 00000 n \n" % start for start in starts)
        data += f"trailer\n<< /Size {len(starts) + 1} /Root 1 0 R /Info {info} 0 R >>\n".encode()
        return bytes(data + f"startxref\n{table}\n%%EOF\n".encode())
