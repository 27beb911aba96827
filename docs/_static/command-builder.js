// The command builder of the page *Commands*: reads the tables of the page, and puts a command together. No network.
function make(tag, text = "", attributes = {}) {
  const element = document.createElement(tag);
  element.textContent = text;
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

function commandsOfThePage() {
  const found = new Map();
  for (const table of document.querySelectorAll("article table")) {
    const section = table.closest("section");
    if (!table.querySelector("th")?.textContent.startsWith("argument or option")) continue;
    const name = section.querySelector("h2").firstChild.textContent.trim();
    const rows = [...table.querySelectorAll("tbody tr")].map((row) => {
      const [word, ...rest] = row.cells[0].textContent.trim().split(" ");
      const help = row.cells[1].textContent.trim();
      const required = help.includes("[required]"), several = /several|Twice/.test(help);
      return { word, value: rest.join(" "), help, option: word.startsWith("--"), required, several };
    });
    found.set(name, rows);
  }
  return found;
}

function quoted(text) {
  return /^[\w@%+=:,./…-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}

// The words of the command. An option that can be given several times is repeated for each word of its field.
function wordsOf(command, fields) {
  const words = ["flockscope", command];
  for (const { row, input } of fields) {
    const value = input.value.trim();
    if (row.option && !row.value) words.push(...(input.checked ? [row.word] : []));
    else if (row.option && value) words.push(...(row.several ? value.split(/\s+/) : [value]).flatMap((one) => [row.word, quoted(one)]));
    else if (row.option) words.push(...(row.required ? [row.word, row.value] : []));
    else if (value) words.push(...(row.word.includes("…") ? value.split(/\s+/) : [value]).map(quoted));
    else if (row.required) words.push(row.word.replace(/\|.*/, ""));
  }
  return words;
}

function build() {
  const commands = commandsOfThePage();
  const title = document.querySelector("article h1");
  if (!commands.size || !title) return;
  const box = make("div", "", { class: "command-builder" });
  const select = make("select", "", { "aria-label": "command" });
  for (const name of commands.keys()) select.append(make("option", name));
  select.value = "generate";
  const list = make("div", "", { class: "command-builder-fields" });
  const code = make("code", "", { "aria-live": "polite" });
  const copy = make("button", "copy", { type: "button" });
  let fields = [];
  const write = () => {
    const words = wordsOf(select.value, fields).map((word) => make("span", word, word.startsWith("--") ? { class: "option" } : {}));
    code.replaceChildren(...words.flatMap((word, k) => (k ? [" ", word] : [word])));
    copy.textContent = "copy";
  };
  const choose = () => {
    fields = commands.get(select.value).map((row) => {
      const flag = row.option && !row.value;
      const input = make("input", "", { type: flag ? "checkbox" : "text", placeholder: row.value });
      const label = make("label", "", { title: row.help });
      label.append(make("code", row.word + (row.required ? " *" : "")), input, make("small", row.help));
      return { row, input, label };
    });
    list.replaceChildren(...fields.map((field) => field.label));
    write();
  };
  copy.addEventListener("click", () => {
    getSelection().selectAllChildren(code);
    document.execCommand("copy");
    copy.textContent = "copied";
  });
  select.addEventListener("change", choose);
  list.addEventListener("input", write);
  const shown = make("pre");
  shown.append(code);
  box.append(make("strong", "Build a command "), select, shown, copy, list);
  title.after(box);
  choose();
}

document.addEventListener("DOMContentLoaded", () => { if (location.pathname.endsWith("commands.html")) build(); });
