// A file that is dropped anywhere goes the way of viser's button, which takes one from its dialogue alone.
// A browser would leave the page otherwise, and show the file.
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
