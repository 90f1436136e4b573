"""Script that a page gets for computers without a GPU: it draws without smoothed edges there.

viser asks for smoothed edges in any case. Where a processor draws, they take a third of a picture's time
(bench/RESULTS-view.md); where a GPU draws, nothing changes. It also has each picture copied before it is shown, so that
a server can ask for it, which none does here. A worker asks which of the two draws, so that the browser's drawing
process begins while the page is still read.
"""

from __future__ import annotations

__all__ = ["with_plain_edges"]

_SCRIPT = """
(function () {
  const plain = HTMLCanvasElement.prototype.getContext;
  const inSoftware = (gl) => {
    if (gl === null) return false;
    const told = gl.getExtension('WEBGL_debug_renderer_info');
    const name = String(gl.getParameter(told === null ? gl.RENDERER : told.UNMASKED_RENDERER_WEBGL));
    const lose = gl.getExtension('WEBGL_lose_context');
    if (lose !== null) lose.loseContext();
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
  };
  let software = null;
  const ask = `postMessage((${inSoftware})(new OffscreenCanvas(1, 1).getContext('webgl2')))`;
  const asked = new Worker(URL.createObjectURL(new Blob([ask])));
  asked.onmessage = (event) => { software = event.data; asked.terminate(); };
  HTMLCanvasElement.prototype.getContext = function (kind, wanted, ...more) {
    if (kind !== 'webgl2' || !wanted || !wanted.antialias) return plain.call(this, kind, wanted, ...more);
    if (software === null) software = inSoftware(plain.call(document.createElement('canvas'), 'webgl2'));
    const cheap = { ...wanted, antialias: false, preserveDrawingBuffer: false };
    return plain.call(this, kind, software ? cheap : wanted, ...more);
  };
})();
"""


def with_plain_edges(page: str) -> str:
    """Return a page with the script in its head, before anything that draws."""
    return page.replace("<head>", f"<head><script>{_SCRIPT}</script>", 1)
