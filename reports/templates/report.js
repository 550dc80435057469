"use strict";
// Tables of the report sort and filter. Every page is complete without this script.

// Return the number in a cell of numbers, "76.6 % (71.7 to 81)" has the number 76.6, or the text.
function value(row, column) {
  const cell = row.cells[column];
  if (!cell) return "";
  const text = cell.textContent.trim();
  if (!cell.classList.contains("number")) return text.toLowerCase();
  const number = parseFloat(text.replace(/,(?=\d{3})/g, "").replace("−", "-"));
  return Number.isNaN(number) ? text.toLowerCase() : number;
}

function compare(first, second) {
  const areNumbers = typeof first === "number" && typeof second === "number";
  return areNumbers ? first - second : String(first).localeCompare(String(second));
}

// Sort the rows of each part of a table. The heading of a part, one wide cell, stays first.
function sort(table, column, sign) {
  for (const body of table.tBodies) {
    const rows = [...body.rows].filter((row) => row.cells.length > 1);
    rows.sort((a, b) => sign * compare(value(a, column), value(b, column)));
    body.append(...rows);
  }
}

function makeSortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    if (!head.textContent.trim()) return;
    const button = document.createElement("button");
    button.className = "sort";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const isUp = head.ariaSort !== "ascending";
      heads.forEach((other) => { other.ariaSort = null; });
      head.ariaSort = isUp ? "ascending" : "descending";
      sort(table, column, isUp ? 1 : -1);
    });
  });
}

// Show the rows that contain all words and, if `pair` is given, have this pair of classes.
function filter(table, words, pair) {
  for (const row of table.tBodies[0].rows) {
    const text = row.textContent.toLowerCase();
    const hasWords = words.every((word) => text.includes(word));
    row.hidden = !hasWords || (pair !== "" && row.dataset.pair !== pair);
  }
}

// Add the controls of a filter above a table: words, and a button that shows all rows again.
// A number of the matrix of classes shows only its recordings.
function makeFiltered(table, matrix) {
  const label = document.createElement("label");
  label.className = "filter";
  const input = document.createElement("input");
  input.type = "search";
  const all = document.createElement("button");
  all.textContent = "Show all";
  all.hidden = true;
  label.append("Filter: ", input, " ", all);
  table.parentElement.before(label);

  function show(text, pair) {
    input.value = text;
    filter(table, text.toLowerCase().split(/\s+/).filter(Boolean), pair);
    all.hidden = text === "" && pair === "";
  }
  input.addEventListener("input", () => show(input.value, ""));
  all.addEventListener("click", () => show("", ""));
  for (const link of matrix ? matrix.querySelectorAll("a") : []) {
    link.addEventListener("click", () => show("", link.hash.slice(1)));
  }
}

for (const table of document.querySelectorAll("table:not(.forest):not(.matrix)")) {
  if (table.tHead && table.tBodies.length && table.rows.length > 2) makeSortable(table);
}
for (const table of document.querySelectorAll("table.filtered")) {
  makeFiltered(table, table.closest("details").querySelector("table.matrix"));
}
