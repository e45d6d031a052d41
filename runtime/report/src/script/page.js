// Light and dark, copying; what the scripts share.
const mpgx = {};
(() => {
  'use strict';
  const root = document.documentElement;
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const store = (value) => { try { value ? localStorage.setItem('theme', value) : value = localStorage.getItem('theme'); } catch { /* no storage here */ } return value; };
  const changed = () => document.dispatchEvent(new Event('theme'));
  const saved = store();
  if (saved === 'light' || saved === 'dark') root.dataset.theme = saved;
  document.querySelector('.theme').addEventListener('click', () => {
    const now = root.dataset.theme || (dark.matches ? 'dark' : 'light');
    root.dataset.theme = store(now === 'dark' ? 'light' : 'dark');
    changed();
  });
  dark.addEventListener('change', changed);
  // Paper is white; what is drawn on canvases must know before.
  let before;
  addEventListener('beforeprint', () => { before = root.dataset.theme; root.dataset.theme = 'light'; changed(); });
  addEventListener('afterprint', () => { if (before) root.dataset.theme = before; else delete root.dataset.theme; changed(); });
  for (const button of document.querySelectorAll('[data-copy]')) {
    button.addEventListener('click', async () => {
      try { await navigator.clipboard.writeText(button.dataset.copy); button.textContent = 'copied'; }
      catch { getSelection().selectAllChildren(button.previousElementSibling); button.textContent = 'selected'; }
      setTimeout(() => { button.textContent = 'copy'; }, 1500);
    });
  }
})();
