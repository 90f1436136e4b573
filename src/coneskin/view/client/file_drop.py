"""Script that a page gets on which files may be dropped: viser's own takes a file from its button's dialogue alone.

A file that is dropped anywhere on the page goes the way of that button. Without it, a browser would leave the page and
show the file.
"""

from __future__ import annotations

__all__ = ["with_file_drop"]

_SCRIPT = """
(function () {
  const carries = (event) => event.dataTransfer !== null && [...event.dataTransfer.types].includes('Files');
  const show = (over) => { document.documentElement.style.boxShadow = over ? 'inset 0 0 0 4px #2563eb' : ''; };
  document.addEventListener('dragover', (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = 'copy';
    show(true);
  }, true);
  document.addEventListener('dragleave', (event) => { if (event.relatedTarget === null) show(false); }, true);
  document.addEventListener('drop', (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    show(false);
    const button = document.querySelector('input[type=file]');
    if (button === null || event.dataTransfer.files.length === 0) return;
    const first = new DataTransfer();
    first.items.add(event.dataTransfer.files[0]);
    button.files = first.files;
    button.dispatchEvent(new Event('change', { bubbles: true }));
  }, true);
})();
"""


def with_file_drop(page: str) -> str:
    """Return a page with the script in its head."""
    return page.replace("<head>", f"<head><script>{_SCRIPT}</script>", 1)
