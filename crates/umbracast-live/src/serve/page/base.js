"use strict";
const $ = id => document.getElementById(id);
// The token is in a cookie from here on, and no longer where histories and screens show it.
if (location.search.includes("token=")) history.replaceState(null, "", location.pathname);
// Colours of the theme, read anew when it changes: to ask a browser for one lays the page out.
let tints = null, colours = null;
const css = name => (colours ??= {})[name] ??= getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
function tintOf(name) {
  tints ??= {};
  return tints[name] ??= [1, 3, 5].map(i => parseInt(css(name).slice(i, i + 2), 16) / 255);
}
// What says the same already is not laid out anew.
const say = (element, text) => { if (element.textContent !== text) element.textContent = text; };
const made = (name, looks = "", text = "") => { const e = document.createElement(name); if (looks) e.className = looks; if (text) e.textContent = text; return e; };
const clock = ns => new Date(ns / 1e6).toISOString().slice(11, 19);
$("theme").onclick = () => { const root = document.documentElement,
  dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark"; tints = colours = null; themed(); };
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { tints = colours = null; themed(); });
