// viser smooths edges and copies each picture for a server that may ask. Without a GPU the first takes a third of a
// picture's time (measured at 13b7922), so a worker asks what draws, while the page is still read.
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
