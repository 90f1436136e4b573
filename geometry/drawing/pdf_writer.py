"""Writer of the structure of a PDF file: objects, pages, cross-reference table."""

from __future__ import annotations

__all__ = ["PdfWriter", "pdf_number"]


def pdf_number(value: float) -> str:
    """Return a number to five decimals without an exponent, which PDF does not allow."""
    text = f"{value:.5f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


class PdfWriter:
    """Collection of the objects of a file, written at the end (PDF 1.5, ISO 32000-1 section 7.5)."""

    def __init__(self) -> None:
        self._objects: list[str] = ["", ""]  # 1: catalogue, 2: page tree
        self._pages: list[int] = []

    def add(self, body: str) -> int:
        """Add an object and return its number."""
        self._objects.append(body)
        return len(self._objects)

    def add_stream(self, data: str, entries: str = "") -> int:
        """Add a stream of ASCII text with further entries for its dictionary and return its number."""
        return self.add(f"<< {entries} /Length {len(data)} >>\nstream\n{data}\nendstream")

    def add_page(self, entries: str) -> None:
        """Add a page with the entries of its dictionary."""
        self._pages.append(self.add(f"<< /Type /Page /Parent 2 0 R {entries} >>"))

    def finish(self, entries: str, title: str) -> bytes:
        """Return the bytes of the file, with further entries for the catalogue and a title."""
        escaped = title.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
        info = self.add(f"<< /Title ({escaped}) /Producer (coneskin) >>")
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
