"""Style and scripts of a page in a browser, of one that Python serves and of one in a file.

The browser counts by itself how old the page is, so that a guard, a server or a network that is silent shows. Its clock
and the server's differ by what the quickest message took, which may drift by as much as two poor crystals.
"""

from __future__ import annotations

_PANEL_STYLE = """
#coneskin-notice{border:1px solid #b45309;background:#fef3c7;color:#78350f;padding:6px 8px;font-size:12px}
#coneskin-notice,.coneskin-phase,.coneskin-card,.coneskin-title,#coneskin-stale,#coneskin-clock,#coneskin-levels,
#coneskin-events,#coneskin-traces,#coneskin-legend{margin:4px 10px}
.coneskin-phase{color:#fff;padding:6px 10px;font-size:15px;background:#6b7280}.coneskin-phase::before{content:"? "}
.coneskin-phase.active{background:#1d7dc9}.coneskin-phase.active::before{content:"\\25B6\\FE0E  "}
.coneskin-phase.moving{background:#fff3b8;color:#111827;outline:1px solid #4a0d18}
.coneskin-phase.moving::before{content:"\\25C6  "}
.coneskin-phase.stopped{background:#4a0d18}.coneskin-phase.stopped::before{content:"\\25A0  "}
.coneskin-old .coneskin-phase{color:#fff;outline:none;
background:repeating-linear-gradient(45deg,#6b7280 0 8px,#5b616d 8px 16px)}
.coneskin-old .coneskin-phase::before{content:"\\2715  "}
.coneskin-old canvas[data-engine],.coneskin-old #coneskin-timeline{filter:grayscale(1) opacity(.35)}
#coneskin-clock{font:13px monospace}#coneskin-clock[data-sent]:not(:empty)::before{content:"live, "}
.coneskin-old #coneskin-clock[data-sent]:not(:empty)::before{content:"old, "}
.coneskin-over tr[data-row=next]{display:none}
.coneskin-card{border-left:6px solid #4a0d18;background:#f3f4f6;color:#111827;font-size:12px;padding:4px 8px}
.coneskin-card th{text-align:left;font-weight:600;padding-right:1em;vertical-align:top;white-space:nowrap}
.coneskin-title{font-size:13px;word-break:break-all;font-weight:700}#coneskin-levels,#coneskin-legend{font-size:12px}
#coneskin-events{font:11px/1.5 monospace}
#coneskin-events>div{padding-left:9ch;text-indent:-9ch;overflow:hidden;overflow-wrap:anywhere;cursor:pointer;
display:-webkit-box;-webkit-box-orient:vertical;-webkit-line-clamp:3}
#coneskin-events>.now,#coneskin-events>div:hover,#coneskin-events>div:focus{display:block}
#coneskin-events>.alarm{color:#8f1421}#coneskin-events>.now{font-weight:700}#coneskin-events>.ahead{opacity:.45}
.coneskin-timeline{position:relative;margin:4px 10px 0;overflow:hidden}#coneskin-timeline{width:100%;display:block}
.coneskin-cursor,.coneskin-pointer{position:absolute;top:0;bottom:0;width:2px;background:#111827;pointer-events:none}
.coneskin-cursor{left:-9px}.coneskin-pointer{width:1px}#coneskin-traces{font-size:11px}
.coneskin-plot{position:relative;overflow:hidden;border-bottom:1px solid #111827;border-left:1px solid #111827}
.coneskin-plot svg{display:block;width:100%;background:#f9fafb}
.coneskin-plot>span{position:absolute;left:3px;background:#f9fafbcc;color:#111827}.coneskin-read{min-height:1.4em}
.coneskin-ends{display:flex;justify-content:space-between}[class*=Notifications-root]{display:none!important}
#coneskin-top{position:fixed;z-index:20;left:0;top:0}#coneskin-top>div:not(#coneskin-stale){display:none}
#coneskin-stale{background:#111827;color:#fbbf24;padding:6px 10px;font-size:15px}#coneskin-stale:empty{display:none}
@media(max-width:700px){#root .coneskin-phase,#root .coneskin-card{display:none!important}
#coneskin-top>div:not(#coneskin-stale){display:block}
#coneskin-top{right:0;background:#fff;padding:2px 0 4px;max-height:45vh;overflow:auto;box-shadow:0 1px 6px #0006}}
"""

_PANEL_SCRIPT = """
(function () {
  const all = (words) => [...document.querySelectorAll(words)];
  const put = (place, key, value) => { if (place[key] !== value) place[key] = value; };
  let sent = 0, offset = Infinity, looked = 0, chosen = '0', pointer = null, folded = false;
  function silence(clock) {  // of the guard and of the page's server [s]
    const now = performance.now() / 1e3, told = Number(clock.dataset.sent);
    if (told < sent) offset = Infinity;  // another server
    if (told !== sent) {
      offset = Math.min(now - told, offset + 2e-4 * (now - looked));
      [looked, sent] = [now, told];
    }
    return [now - offset - (clock.dataset.news || told), now - offset - told];
  }
  function follow() {
    const clock = document.getElementById('coneskin-clock');
    if (clock === null) return;
    let words = '';
    if (clock.dataset.sent) {
      const [guard, server] = silence(clock), over = clock.dataset.over, old = over || guard > 1;
      document.documentElement.classList.toggle('coneskin-old', Boolean(old));
      document.documentElement.classList.toggle('coneskin-over', Boolean(over));
      all('#root .coneskin-phase').forEach((phase) => put(phase, 'textContent', !old ? phase.dataset.text
        : `was ${phase.dataset.text}${over ? ': the run is over' : `, ${Math.floor(guard)} s ago`}`));
      words = over ? 'the run is over: this is its last moment' : old ? `NOTHING NEW from the ${server > 1
        ? "page's server" : 'guard'} for ${Math.floor(guard)} s: what is drawn is old` : '';
    }
    all('#root .coneskin-phase').slice(0, 1).forEach(() => showOnTop(words));
    if (clock.dataset.share) all('.coneskin-cursor').forEach((line) => put(line.style, 'left', clock.dataset.share));
    all('#coneskin-traces select').forEach((choice) => put(choice, 'value', chosen));
    all('.coneskin-trace').forEach((trace, k) => put(trace, 'hidden', String(k) !== chosen));
    all('.coneskin-plot').forEach(read);
  }
  function showOnTop(words) {  // of the scene what is old; in a narrow window phase and card too, and the panel folded
    const top = document.getElementById('coneskin-top')
      || Object.assign(document.body.appendChild(document.createElement('div')), { id: 'coneskin-top' });
    const parts = all('#root .coneskin-phase, #root .coneskin-card').map((part) => part.outerHTML);
    const shown = `<div id="coneskin-stale">${words}</div>${parts.join('')}`;
    if (top.shown !== shown) top.innerHTML = top.shown = shown;
    const handle = all('#root div').find((div) => div.style.height === '3.5em' && div.style.cursor === 'pointer');
    if (handle && !folded) handle.click();  // of viser's panel for a narrow window
    folded = folded || Boolean(handle);
  }
  function read(plot) {  // the values under the pointer
    const box = plot.getBoundingClientRect(), line = plot.querySelector('.coneskin-pointer');
    const share = pointer === null ? -1 : (pointer.clientX - box.left) / box.width;
    line.hidden = !(share >= 0 && share <= 1 && pointer.clientY >= box.top && pointer.clientY <= box.bottom);
    const words = line.hidden ? [] : all('path').filter((path) => plot.contains(path)).map((path) => {
      let best = null;
      for (const point of path.getAttribute('d').slice(1).split(/[ML]/)) {
        const [x, y] = point.split(' ').map(Number), off = Math.abs(x - share * plot.dataset.width);
        if (best === null || off < best[0]) best = [off, y];
      }
      const value = plot.dataset.high - best[1] / plot.dataset.height * (plot.dataset.high - plot.dataset.low);
      return `${path.dataset.name} ${value.toFixed(3)}`;
    });
    const time = Number(plot.dataset.since) + share * (plot.dataset.until - plot.dataset.since);
    line.style.left = `${100 * share}%`;
    put(plot.nextElementSibling, 'textContent', words.length ? `${time.toFixed(3)} s: ${words.join(', ')}` : '');
  }
  addEventListener('pointermove', (event) => { pointer = event; all('.coneskin-plot').forEach(read); }, true);
  addEventListener('change', (event) => {
    if (event.target.closest && event.target.closest('#coneskin-traces')) { chosen = event.target.value; follow(); }
  }, true);
  setInterval(follow, 100);
})();
"""
# viser smooths edges and copies each picture for a server that may ask. Without a GPU the first takes a third of a
# picture's time (measured at 13b7922), so a worker asks what draws, while the page is still read.
_PLAIN_EDGES_SCRIPT = """
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
#: for the head of a page, before anything that draws
PANEL_HEAD = (
    f"<style id=coneskin-style>{_PANEL_STYLE}</style><script>{_PLAIN_EDGES_SCRIPT}</script>"
    f"<script>{_PANEL_SCRIPT}</script>"
)
