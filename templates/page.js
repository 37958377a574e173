"use strict";
// What both pages use.
const $ = (selector, within = document) => within.querySelector(selector);
const $$ = (selector, within = document) => [...within.querySelectorAll(selector)];
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// Buttons that copy the text of the element they name.
for (const button of $$("button[data-copy]")) {
  button.addEventListener("click", async () => {
    const source = document.getElementById(button.dataset.copy);
    try {
      await navigator.clipboard.writeText(source.textContent);
      button.textContent = "Copied";
    } catch {
      // Some browsers allow no copying from a page on disk: then it is marked, to be copied by hand.
      getSelection().selectAllChildren(source);
      button.textContent = "Marked: copy it";
    }
  });
}

// Whether a key is meant for the element that has the focus, not for the page.
function keyIsTaken(event) {
  const at = event.target;
  if (event.ctrlKey || event.altKey || event.metaKey) return true;
  // A slider keeps the focus after a click, and has no use for letters and the blank.
  if (at.matches("input[type=range]")) return /^(Arrow|Home$|End$|Page)/.test(event.key);
  return at.matches("input, select, textarea, summary");
}
