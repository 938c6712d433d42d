// A click on a row of the worst frames shows the pictures of that frame, one at a time.
'use strict';
for (const part of document.querySelectorAll('.worst')) {
  const rows = [...part.querySelectorAll('tbody tr')];
  const show = (chosen) => {
    for (const row of rows) {
      const isChosen = row === chosen;
      row.classList.toggle('chosen', isChosen);
      row.querySelector('button').setAttribute('aria-expanded', String(isChosen));
      document.getElementById(row.dataset.pictures).hidden = !isChosen;
    }
  };
  for (const row of rows) {
    row.addEventListener('click', () => show(row));
  }
  show(rows[0]);
}
