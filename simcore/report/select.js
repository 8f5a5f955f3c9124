// The selected candidate: what is told of it, its replay, and the bar that leads to both from elsewhere on the page.
(() => {
  "use strict";
  const candidates = new Map(JSON.parse(document.getElementById("candidates").textContent).map((each) => [each.id, each]));
  const section = document.getElementById("candidate");
  const choice = document.getElementById("candidate-choice");
  const bar = document.querySelector(".chosen");
  const root = section.querySelector(".replay");

  function make(tag, text, className) {
    const made = document.createElement(tag);
    made.textContent = text ?? "";
    if (className) made.className = className;
    return made;
  }

  function badge(each) {
    const made = make("span", "", `badge ${each.verdict}`);
    const mark = make("span", each.mark);
    mark.setAttribute("aria-hidden", "true");
    made.append(mark, ` ${each.verdict}`);
    return made;
  }

  /** A limit as its title, how much of it is left, and a bar that grows from its middle, to the left when it is exceeded. */
  function marginLine([title, limit, text, share, part, over]) {
    const line = make("li", "", over ? "over" : "");
    const name = make("span", title);
    if (limit) name.append(" ", make("small", `${limit}${part ? `; least: ${part}` : ""}`));
    const scale = make("span", "", "scale");
    const filled = make("i");
    const width = 50 * Math.min(Math.abs(share), 1);
    Object.assign(filled.style, { left: `${share < 0 ? 50 - width : 50}%`, width: `${width}%` });
    scale.append(filled);
    line.append(name, scale, make("b", `${over ? "! " : ""}${text}`));
    return line;
  }

  function tell(each) {
    const told = document.getElementById("candidate-template").content.cloneNode(true);
    const find = (name) => told.querySelector(name);
    find(".badge").replaceWith(badge(each));
    find(".why").textContent = each.verdict === "failed" ? `It failed: ${each.why}.` : `It ${each.why}.`;
    find(".doubts").hidden = !each.doubt;
    find(".doubts").textContent = `Its certificate failed: ${each.doubt}.`;
    for (const [title, text] of each.figures) {
      const pair = make("div");
      pair.append(make("dt", title), make("dd", text));
      find(".pairs").append(pair);
    }
    if (!each.figures.length) find(".pairs").append(make("div", "There are none: the simulation failed."));
    find(".margins").hidden = !each.margins.length;
    find(".margins ul").append(...each.margins.map(marginLine));
    find("code").textContent = each.command;
    find(".copy").addEventListener("click", (event) => copy(each.command, event.target));
    document.getElementById("candidate-told").replaceChildren(told);
  }

  async function copy(text, button) {
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    } catch {
      getSelection().selectAllChildren(button.previousElementSibling); // to be copied by hand
      button.textContent = "Selected";
    }
    setTimeout(() => (button.textContent = "Copy"), 1500);
  }

  function replay(each) {
    if (!root) return;
    const there = document.getElementById(`replay-run-${each.id}`);
    const note = section.querySelector(".unplayed");
    note.hidden = Boolean(there);
    note.textContent = `The replay below is of other candidates: this one's is not in this file. simcore replay ${section.dataset.folder}/${each.id}.nc makes it, if the run was kept.`;
    if (there) root.player.put(`run-${each.id}`);
  }

  function showBar(each) {
    const close = make("button", "✕");
    close.type = "button";
    close.setAttribute("aria-label", "Close");
    close.addEventListener("click", () => (bar.hidden = true));
    const link = make("a", "Figures and replay");
    link.href = "#candidate";
    const key = each.figures.filter(([title]) => ["Fall margin", "Peak pressure"].includes(title));
    bar.replaceChildren(badge(each), make("b", each.place), ...key.map(([title, text]) => make("span", `${title.toLowerCase()} ${text}`)), link, close);
    bar.hidden = bar.seen;
  }

  /** Scroll a wide table, and nothing else, until a cell is beside the names of its rows. */
  function bringIntoSight(button) {
    const table = button.closest(".scroll"), cell = button.closest("td");
    const names = cell.parentElement.cells[0].offsetWidth;
    const [left, right] = [cell.offsetLeft - names, cell.offsetLeft + cell.offsetWidth - table.clientWidth];
    table.scrollLeft = Math.min(Math.max(table.scrollLeft, right), left);
  }

  function select(id, byReader = true) {
    const each = candidates.get(id);
    if (!each) return;
    choice.value = id;
    document.querySelectorAll("[data-candidate]").forEach((button) => button.setAttribute("aria-pressed", button.dataset.candidate === id));
    document.querySelectorAll(".matrix [data-candidate]").forEach((button) => (button.tabIndex = button.dataset.candidate === id ? 0 : -1));
    document.querySelectorAll(".matrix [aria-pressed=true]").forEach(bringIntoSight);
    tell(each);
    if (byReader) {
      replay(each);
      showBar(each);
    }
  }

  document.addEventListener("simcore:select", (event) => select(event.detail));
  const ask = (id) => document.dispatchEvent(new CustomEvent("simcore:select", { detail: id }));
  choice.addEventListener("change", () => ask(choice.value));
  document.querySelectorAll("[data-candidate]").forEach((button) => button.addEventListener("click", () => {
    ask(button.dataset.candidate);
    if (!button.closest(".matrix")) section.scrollIntoView();
  }));

  // In a table of verdicts the arrows go from cell to cell, and Tab leaves it.
  document.querySelectorAll(".matrix").forEach((table) => table.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    const cell = event.target.closest("td");
    if (!step || !cell) return;
    const row = table.rows[cell.parentElement.rowIndex + step[0]];
    const next = row?.cells[cell.cellIndex + step[1]]?.querySelector("button");
    if (!next) return;
    event.preventDefault();
    next.focus();
    ask(next.dataset.candidate);
  }));

  new IntersectionObserver(([entry]) => {
    bar.seen = entry.isIntersecting;
    if (bar.seen) bar.hidden = true;
  }).observe(section);

  select(choice.value, false);
  // A table without the selected candidate has to be reached by Tab, too.
  document.querySelectorAll(".matrix").forEach((table) => {
    const cells = [...table.querySelectorAll("[data-candidate]")];
    if (cells.length && cells.every((each) => each.tabIndex < 0)) cells[0].tabIndex = 0;
  });
})();
