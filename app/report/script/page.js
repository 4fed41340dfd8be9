// What the scripts of a report share: its data, elements of the page, numbers as text, the instant that it shows. The
// page holds its data in the JSON block "data" (html_page.cpp, motion_scene.cpp). Nothing is loaded.
const data = JSON.parse(document.getElementById("data").textContent);
document.documentElement.classList.add("scripted");

// An element with attributes and children, of the page or of a drawing.
const element = (tag, attributes, children) => filled(document.createElement(tag), attributes, children);
const drawings = Object.assign(document.createElement("div"), {innerHTML: "<svg></svg>"}).firstChild.namespaceURI;
const svg = (tag, attributes, children) => filled(document.createElementNS(drawings, tag), attributes, children);
function filled(e, attributes = {}, children = []) {
  set(e, attributes);
  e.append(...children);
  return e;
}
function set(e, attributes) { for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value); }
function shown(value, digits = 6) {
  return value === null || value === undefined ? "-" : String(Number(value.toPrecision(digits)));
}

// The instant that all plots over time and all mechanisms of the page show.
const cursor = {t: null, listeners: [], set(t) { this.t = t; for (const f of this.listeners) f(t); }};
