// One of several parts of the page at a time, by selectors: the plots of a trade-off, the differences of a check.

class Choices {
  constructor(box) {
    this.parts = [...box.children].map(e => ({element: e, keys: JSON.parse(e.dataset.keys)}));
    this.selects = JSON.parse(box.dataset.choices).map((name, i) => {
      const select = element("select", {"aria-label": name});
      select.onchange = () => this.pick(this.match([...this.shown.keys.slice(0, i), select.value]));
      return [name, select];
    });
    const labels = this.selects.map(([name, select]) => element("label", {}, [name + " ", select]));
    box.prepend(element("p", {class: "controls"}, labels));
    for (const part of this.parts) {
      const links = part.element.id ? document.querySelectorAll(`a[href="#${part.element.id}"]`) : [];
      for (const link of links) link.addEventListener("click", () => this.pick(part));
    }
    this.pick(this.parts[0]);
    addEventListener("beforeprint", () => this.parts.forEach(part => part.element.hidden = false));
    addEventListener("afterprint", () => this.pick(this.shown));
  }

  // The part with these first keys, and of those the one that shares most with what is shown.
  match(first) {
    const fitting = this.parts.filter(part => first.every((key, i) => part.keys[i] == key));
    const shared = part => part.keys.filter((key, i) => key == this.shown.keys[i]).length;
    return fitting.reduce((best, part) => shared(part) > shared(best) ? part : best);
  }

  // Each selector offers what there is with the choices before it.
  pick(part) {
    this.shown = part;
    for (const p of this.parts) p.element.hidden = p != part;
    this.selects.forEach(([, select], i) => {
      const fitting = this.parts.filter(p => p.keys.slice(0, i).every((key, k) => key == part.keys[k]));
      const keys = [...new Set(fitting.map(p => p.keys[i]))];
      select.replaceChildren(...keys.map(key => element("option", {value: key}, [key])));
      select.value = part.keys[i];
    });
  }
}
