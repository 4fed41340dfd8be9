// Two runs beside each other: what both or one of them computed, and the relative difference.

class Comparison {
  constructor(box, runs) {
    const choices = index => {
      const select = element("select", {"aria-label": "run " + (index + 1)},
                             runs.map((run, k) => element("option", {value: k}, [run.name])));
      select.value = index, select.onchange = () => this.show();
      return select;
    };
    this.runs = runs, this.selects = [choices(0), choices(1)], this.body = element("tbody");
    this.header = element("thead");
    box.append(element("p", {}, [this.selects[0], " and ", this.selects[1]]),
               element("div", {class: "table", tabindex: "0"}, [element("table", {}, [this.header, this.body])]));
    this.show();
  }

  show() {
    const [a, b] = this.selects.map(s => this.runs[s.value]);
    const cell = (tag, [text, title]) => element(tag, title ? {title} : {}, [text]);
    const row = (tag, cells) => element("tr", {}, cells.map(c => cell(tag, c)));
    this.header.replaceChildren(row("th", [[""], [a.name], [b.name], ["difference [%]"]]));
    const number = v => typeof v == "number" ? [shown(v), String(v)] : ["-"];
    const names = new Set([...Object.keys(a.numbers), ...Object.keys(b.numbers)]);
    this.body.replaceChildren(...[...names].map(name => {
      const [x, y] = [a.numbers[name], b.numbers[name]];
      const known = typeof x == "number" && typeof y == "number" && x != 0;
      return row("td", [[name], number(x), number(y), [known ? shown(100 * (y - x) / Math.abs(x), 3) : "-"]]);
    }));
  }
}
