// Loaded before textual.js. Every key reaches the terminal wherever the focus is (F5 would reload the page and end this
// console), and a connection that has fallen silent is told.
"use strict";

const SILENCE = 3500; // ms; the server sends something every second
let last = Date.now();
let connected = false;

window.WebSocket = class extends window.WebSocket {
  constructor(...words) {
    super(...words);
    this.addEventListener("open", () => {
      connected = true;
      last = Date.now();
    });
    this.addEventListener("message", () => {
      last = Date.now();
    });
  }
};

const closed = () => document.body.classList.contains("-closed");
const keyboard = () => document.querySelector(".xterm-helper-textarea");

setInterval(() => {
  document.body.classList.toggle("-silent", connected && Date.now() - last > SILENCE);
  const area = keyboard();
  if (area && !closed() && document.activeElement !== area) area.focus();
}, 250);

window.addEventListener(
  "keydown",
  (event) => {
    const area = keyboard();
    if (!area || closed() || event.target === area) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    area.focus();
    const { key, code, keyCode, which, ctrlKey, shiftKey, altKey, metaKey } = event;
    area.dispatchEvent(
      new KeyboardEvent("keydown", {
        key, code, keyCode, which, ctrlKey, shiftKey, altKey, metaKey, bubbles: true, cancelable: true,
      }),
    );
  },
  true,
);
