// A click on a row of the worst frames shows that frame, one at a time, and the viewer goes there.
'use strict';
/* global viewer */
const rows = [...document.querySelectorAll('.worst tbody tr')];
const showRow = (chosen) => {
  for (const row of rows) {
    const isChosen = row === chosen;
    row.classList.toggle('chosen', isChosen);
    row.querySelector('button').setAttribute('aria-expanded', String(isChosen));
    document.getElementById(row.dataset.pictures).hidden = !isChosen;
  }
  const frame = document.getElementById(chosen.dataset.pictures);
  const scene = frame.querySelector('script.scene');
  if (scene) {
    frame.querySelector('h3').after(document.getElementById('viewer'));
    viewer.show(scene);
  }
};
for (const row of rows) row.addEventListener('click', () => showRow(row));
if (rows.length) showRow(rows[0]);
