// The browser counts by itself how old the page is, so that a guard, a server or a network that is silent shows.
// Its clock and the server's differ by what the quickest message took, which may drift by as much as two poor crystals.
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
    all('.coneskin-pointer').forEach(read);
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
  function read(line) {  // the values under the pointer
    const plot = line.parentElement, place = plot.nextElementSibling, box = plot.getBoundingClientRect();
    if (place === null) return;  // a file that the browser is still reading
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
    put(place, 'textContent', words.length ? `${time.toFixed(3)} s: ${words.join(', ')}` : '');
  }
  addEventListener('pointermove', (event) => { pointer = event; all('.coneskin-pointer').forEach(read); }, true);
  addEventListener('change', (event) => {
    if (event.target.closest && event.target.closest('#coneskin-traces')) { chosen = event.target.value; follow(); }
  }, true);
  setInterval(follow, 100);
})();
