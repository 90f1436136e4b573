// Moves the client's own playback by its field for the time, and follows what its slider shows.
(function () {
  const data = JSON.parse(document.getElementById('coneskin-data').textContent);
  const panel = document.getElementById('coneskin');
  const head = document.getElementById('coneskin-head');
  const clock = document.getElementById('coneskin-clock');
  const list = document.getElementById('coneskin-events');
  const cursors = [...panel.querySelectorAll('.coneskin-cursor')];
  const levels = [...panel.querySelectorAll('.coneskin-level')];
  const marks = [...panel.querySelectorAll('.coneskin-level-mark')];
  const forces = [...panel.querySelectorAll('.coneskin-force b')];
  const rows = data.events.map((event) => {
    const row = document.createElement('div');
    row.textContent = event[1];
    row.tabIndex = 0;
    row.onclick = () => jump(event[0]);
    list.appendChild(row);
    return row;
  });
  function field() { return document.querySelector('#root input:not([role=slider])'); }
  function shown() {
    const thumb = document.querySelector('#root [role=slider]');
    return thumb === null ? null : parseFloat(thumb.getAttribute('aria-valuenow'));
  }
  function jump(time) {
    const input = field();
    if (input === null) return;
    const setter = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set;
    const steps = Math.min(Math.max(Math.ceil(1e4 * time), 1), Math.floor(1e4 * data.duration));  // of its slider
    setter.call(input, (1e-4 * steps).toFixed(4));
    input.dispatchEvent(new Event('input', { bubbles: true }));
    input.dispatchEvent(new Event('blur', { bubbles: true }));
  }
  const timeline = document.getElementById('coneskin-timeline');
  timeline.onclick = (event) => {
    const box = timeline.getBoundingClientRect();
    jump(data.duration * (event.clientX - box.left) / box.width);
  };
  function last(changes, time) {
    let found = changes[0];
    for (const change of changes) { if (change[0] <= time + 1e-4) found = change; else break; }
    return found;
  }
  let before = null;
  function follow() {
    const time = shown();
    if (time !== null && time !== before) {
      before = time;
      clock.textContent = (1e-3 * Math.floor(1e3 * (time + data.since))).toFixed(3) + ' s';
      cursors.forEach((cursor) => { cursor.style.left = (100 * time / data.duration) + '%'; });
      const words = last(data.heads, time)[1];  // from Python, which has escaped what a recording says
      if (head.innerHTML !== words) head.innerHTML = words;
      let bar = 0, pressed = 0;
      data.runs.forEach((run) => {
        run.levels.forEach((changes, sheet) => {
          const level = last(changes, time)[1];
          levels[bar].textContent = run.words[sheet][level];
          marks[bar].style.left = level + '%';
          bar += 1;
        });
        if (run.forces.length > 0) { forces[pressed].textContent = last(run.forces, time)[1]; pressed += 1; }
      });
      rows.forEach((row, k) => { row.style.opacity = data.events[k][0] <= time + 1e-4 ? 1 : 0.4; });
    }
    requestAnimationFrame(follow);
  }
  follow();
})();
