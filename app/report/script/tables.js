// Tables are copied as CSV.

// Cells as CSV, with all their digits; RFC 4180 quotes.
function csv_of(table) {
  const quoted = text => /[",\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
  const line = row => [...row.cells].map(c => quoted(c.title || c.textContent)).join(",");
  return [...table.rows].map(line).join("\n") + "\n";
}

function copy(text) {
  const area = element("textarea", {"aria-hidden": "true"});
  area.value = text;
  document.body.append(area);
  area.select();
  document.execCommand("copy");  // also works where the page is opened from disk
  area.remove();
}

for (const box of document.querySelectorAll(".table")) {
  const button = element("button", {type: "button", class: "copy"}, ["copy as CSV"]);
  button.onclick = () => {
    copy(csv_of(box.querySelector("table")));
    button.textContent = "copied";
    setTimeout(() => button.textContent = "copy as CSV", 1500);
  };
  box.after(button);
}
