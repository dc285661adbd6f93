// The page's behaviour: the graph with its search and details, the filter of the tables, light and dark, print.
// All names come from launch files: they are set as text only, never as markup.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const byId = (id) => document.getElementById(id);
  const MOST_MATCHES = 200; // listed at once; the rest is counted
  const LAYERED = 60; // elements up to which the graph is arranged along its arrows; more stand in rows, at once
  const MANY = 2000; // elements from which drawing is made cheaper
  const LONGEST_LABEL = 26; // the end of a ROS name says more than its beginning

  // -- elements ------------------------------------------------------------------------------------------------------

  const members = data.members.map((member, number) => ({ ...member, id: `m${number}`, what: "node", uses: [] }));
  const channels = data.channels.map((channel, number) => ({
    ...channel, id: `c${number}`, what: channel.kind, uses: [], namespace: channel.name.replace(/\/[^/]*$/, "") || "/",
  }));
  const enclaves = data.enclaves.map((name, number) => ({ id: `e${number}`, name, what: "enclave", uses: [] }));
  const enclaveOf = new Map(enclaves.map((enclave) => [enclave.name, enclave]));
  const all = [...enclaves, ...members, ...channels];
  const elementOf = new Map(all.map((element) => [element.id, element]));
  data.uses.forEach((use, number) => {
    use.id = `u${number}`;
    use.holder = use.member === null ? enclaveOf.get(use.enclave) : members[use.member];
    use.name = channels[use.channel];
    use.holder.uses.push(use);
    use.name.uses.push(use);
  });
  for (const element of all) {
    element.builtIn = element.what !== "node" && element.what !== "enclave" && element.uses.every((use) => use.builtIn);
    element.haystack = `${element.name} ${element.program || ""} ${(element.types || []).join(" ")}`.toLowerCase();
  }

  // -- the graph -----------------------------------------------------------------------------------------------------

  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  function style() {
    const text = color("text");
    const box = { "background-color": color("group"), "border-color": color("line"), "border-width": 1, label: "data(label)",
      color: text, "font-size": 13, "min-zoomed-font-size": 5, "font-weight": "bold", "text-valign": "top", shape: "round-rectangle", padding: 14 };
    const named = { label: "data(label)", color: text, "font-size": 12, "min-zoomed-font-size": 5, "text-valign": "center", "text-wrap": "ellipsis",
      "text-max-width": 150, width: 160, height: 30, "border-width": 1, "border-color": color("line") };
    return [
      { selector: "node", style: named },
      { selector: "node.group", style: { ...box, "text-wrap": "none" } },
      { selector: "node.node", style: { "background-color": color("node"), shape: "round-rectangle" } },
      { selector: "node.topic", style: { "background-color": color("topic"), shape: "ellipse" } },
      { selector: "node.service", style: { "background-color": color("service"), shape: "rectangle" } },
      { selector: "node.action", style: { "background-color": color("action"), shape: "hexagon" } },
      { selector: "node.doubtful", style: { "border-style": "dashed", "border-width": 2 } },
      { selector: "edge", style: { width: 1.5, "line-color": color("line"), "target-arrow-color": color("line"),
        "target-arrow-shape": "triangle", "curve-style": data.uses.length > MANY ? "straight" : "bezier" } },
      { selector: ".faded", style: { opacity: 0.2 } },
      { selector: ".away", style: { display: "none" } },
      { selector: ".match", style: { "border-width": 4, "border-color": color("accent") } },
      { selector: "node:selected", style: { "border-width": 4, "border-color": color("accent") } },
      { selector: "edge:selected, edge.near", style: { width: 3, "line-color": color("accent"),
        "target-arrow-color": color("accent") } },
    ];
  }

  const shortened = (name) => (name.length > LONGEST_LABEL ? `\u2026${name.slice(1 - LONGEST_LABEL)}` : name);

  function isShown(element) {
    if (element.what === "node" || element.what === "enclave") return true;
    return byId(`show-${element.what}`).checked && !(byId("hide-built-in").checked && element.builtIn);
  }

  function parentOf(element, grouping, groups) {
    const add = (id, label, parent) => {
      if (!groups.has(id)) groups.set(id, { group: "nodes", classes: "group", data: { id, label, parent } });
      return id;
    };
    const ofEnclave = () => {
      const enclave = enclaveOf.get(element.enclave);
      return enclave ? add(enclave.id, enclave.name) : add("unsecured", "without an enclave");
    };
    if (grouping === "namespace") return add(`s:${element.namespace}`, element.namespace);
    if (element.what !== "node" || grouping === "none") return undefined;
    if (grouping === "enclave") return ofEnclave();
    const outer = ofEnclave();
    return add(`${outer}:${element.namespace}`, `namespace ${element.namespace}`, outer);
  }

  function graphElements() {
    const grouping = byId("group").value;
    const groups = new Map();
    const nodes = [...members, ...channels].filter(isShown).map((element) => ({
      group: "nodes",
      classes: `${element.what}${element.known === false || element.pattern ? " doubtful" : ""}`,
      data: { id: element.id, label: shortened(element.name), parent: parentOf(element, grouping, groups) },
    }));
    for (const enclave of enclaves) { // what only a policy file says has no node to begin at
      if (enclave.uses.length) groups.set(enclave.id, groups.get(enclave.id)
        || { group: "nodes", classes: "group", data: { id: enclave.id, label: enclave.name } });
    }
    const edges = data.uses.filter((use) => isShown(use.name) && !(byId("hide-built-in").checked && use.builtIn))
      .map((use) => ({ group: "edges", data: { id: use.id,
        source: use.out ? use.holder.id : use.name.id, target: use.out ? use.name.id : use.holder.id } }));
    return [...groups.values(), ...nodes, ...edges];
  }

  // Boxes of nodes in rows, the names that they share in a block beside them: instant, and the same each time.
  function inRows(elements) {
    const positions = {};
    const inner = elements.filter((each) => each.group === "nodes" && each.classes !== "group");
    const boxes = new Map();
    for (const each of inner) {
      const key = each.data.parent || each.classes.split(" ")[0];
      boxes.set(key, [...(boxes.get(key) || []), each.data.id]);
    }
    const sizes = [...boxes.values()].map((ids) => ({ ids, columns: Math.ceil(Math.sqrt(ids.length / 3)) }));
    const width = 190 * Math.ceil(Math.sqrt(inner.length / 2));
    let left = 0, top = 0, tallest = 0;
    for (const { ids, columns } of sizes) {
      const across = columns * 180 + 50, down = Math.ceil(ids.length / columns) * 42 + 60;
      if (left > 0 && left + across > width) { left = 0; top += tallest; tallest = 0; }
      ids.forEach((id, number) => {
        positions[id] = { x: left + (number % columns) * 180, y: top + Math.floor(number / columns) * 42 };
      });
      left += across;
      tallest = Math.max(tallest, down);
    }
    return { name: "preset", positions, fit: true, padding: 20 };
  }

  const ALONG_ARROWS = { name: "dagre", rankDir: "LR", animate: false, fit: true, padding: 30, nodeSep: 40, rankSep: 90 };

  let graph = null;

  let home = new Map(); // where elements stand while nothing is left out
  let regrouped = false; // what is seen is arranged by itself

  function draw() {
    const elements = graphElements();
    const few = elements.filter((each) => each.group === "nodes").length <= LAYERED;
    if (graph) graph.destroy();
    graph = window.cytoscape({ container: byId("canvas"), elements, style: style(), minZoom: 0.02, maxZoom: 4,
      layout: few ? ALONG_ARROWS : inRows(elements), userZoomingEnabled: document.activeElement === byId("canvas"),
      hideEdgesOnViewport: elements.length > MANY, textureOnViewport: elements.length > MANY });
    home = new Map(graph.nodes().map((node) => [node.id(), { ...node.position() }]));
    regrouped = isMarked = false;
    graph.on("tap", "node, edge", (event) => choose(event.target.id()));
    graph.on("tap", (event) => { if (event.target === graph) choose(null); });
    search();
  }

  // -- search and details --------------------------------------------------------------------------------------------

  let chosen = null;
  let found = [];

  const searched = () => byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const isSearching = () => searched().length > 0;

  function search() {
    const words = searched();
    found = all.filter((element) => isShown(element) && words.every((word) => element.haystack.includes(word)));
    byId("status").textContent = words.length ? `${found.length} of ${all.filter(isShown).length} elements match`
      : `${members.length} nodes, ${enclaves.length} enclaves, ${channels.filter(isShown).length} names shown`;
    const list = found.slice(0, MOST_MATCHES).map(matchItem);
    if (found.length > MOST_MATCHES) {
      const more = document.createElement("li");
      more.textContent = `and ${found.length - MOST_MATCHES} more`;
      list.push(more);
    }
    byId("matches").replaceChildren(...list);
    mark(isSearching());
  }

  function matchItem(element) {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.id = element.id;
    button.textContent = `${element.name || "/"} (${element.what})`;
    button.setAttribute("aria-current", String(element.id === chosen));
    button.addEventListener("click", () => choose(element.id, true));
    item.append(button);
    return item;
  }

  let isMarked = false;

  function mark(searching) {
    if (!searching && !chosen && !isMarked) return;
    isMarked = searching || chosen !== null;
    const picked = graph.getElementById(chosen || "");
    const only = byId("only-near").checked && isMarked;
    const matches = searching ? graph.collection(found.map((element) => graph.getElementById(element.id))) : graph.collection();
    const centre = searching && !(only && chosen) ? matches : picked;
    const near = centre.union(centre.descendants()).closedNeighborhood();
    const seen = isMarked ? near.union(near.ancestors()) : graph.elements();
    graph.batch(() => {
      graph.elements(".match, .faded, .near, .away").removeClass("match faded near away");
      matches.addClass("match");
      graph.elements().difference(seen).addClass(only ? "away" : "faded");
      picked.connectedEdges().addClass("near");
    });
    arrangeSeen(seen, only);
  }

  // A part that is looked at alone is arranged for itself; after that everything returns to its place.
  function arrangeSeen(seen, only) {
    if (only && seen.nodes().length <= LAYERED) {
      seen.layout(ALONG_ARROWS).run();
      regrouped = true;
    } else if (regrouped) {
      graph.batch(() => graph.nodes(":childless").forEach((node) => node.position(home.get(node.id()))));
      graph.fit(undefined, 20);
      regrouped = false;
    }
  }

  function choose(id, centre) {
    chosen = id;
    graph.elements().unselect();
    for (const button of byId("matches").querySelectorAll("button")) {
      button.setAttribute("aria-current", String(button.dataset.id === id));
    }
    const use = data.uses.find((each) => each.id === id);
    byId("detail").replaceChildren(...(use ? usesDetail(`${use.holder.name} ${use.operation} ${use.name.name}`, [use])
      : elementOf.has(id) ? elementDetail(elementOf.get(id)) : [paragraph("Choose an element in the list or in the graph.")]));
    mark(isSearching());
    const drawn = graph.getElementById(id || "");
    drawn.select();
    if (centre && drawn.nonempty() && !regrouped) {
      graph.zoom(Math.max(graph.zoom(), 0.7));
      graph.center(drawn);
    }
  }

  function paragraph(text) {
    const made = document.createElement("p");
    made.textContent = text;
    return made;
  }

  function elementDetail(element) {
    const title = `${element.what} ${element.name}`;
    const facts = [];
    if (element.what === "node") {
      facts.push(element.enclave ? `enclave ${element.enclave}` : "without an enclave", element.program);
      if (element.place) facts.push(`launched at ${element.place}`);
      if (!element.known) facts.push("What it says in ROS is not known: nothing is permitted for it.");
    }
    if (element.types && element.types.length) facts.push(`type ${element.types.join(", ")}`);
    const hidden = byId("hide-built-in").checked ? element.uses.filter((use) => use.builtIn).length : 0;
    const shown = hidden ? element.uses.filter((use) => !use.builtIn) : element.uses;
    if (element.what === "enclave") {
      const inside = members.filter((member) => member.enclave === element.name);
      facts.push(`nodes: ${inside.map((member) => member.name).join(" ") || "none"}`);
      shown.push(...inside.flatMap((member) => member.uses).filter((use) => !(hidden || byId("hide-built-in").checked) || !use.builtIn));
    }
    const rest = hidden ? [paragraph(`and ${hidden} that every node has`)] : [];
    return [...usesDetail(title, shown, facts), ...rest];
  }

  function usesDetail(title, uses, facts = []) {
    const heading = document.createElement("h3");
    heading.textContent = title;
    const list = document.createElement("dl");
    for (const use of uses) {
      const term = document.createElement("dt");
      term.textContent = `${use.holder.name} ${use.operation} ${use.name.name}`;
      list.append(term, ...(use.why.length ? use.why : ["a policy file; no node asks for it"]).map((why) => {
        const reason = document.createElement("dd");
        reason.textContent = why;
        return reason;
      }));
    }
    return [heading, ...facts.map(paragraph), list];
  }

  // -- tables --------------------------------------------------------------------------------------------------------

  // What every node has: most of all rows, so they are made when somebody asks for them.
  function addBuiltInRows() {
    if (document.querySelector("tr.built-in")) return;
    for (const enclave of document.querySelectorAll("details.enclave")) {
      const name = enclaves[Number(enclave.dataset.enclave)].name;
      enclave.querySelector("tbody").append(...data.uses.filter((use) => use.builtIn && use.enclave === name).map(builtInRow));
    }
  }

  function builtInRow(use) {
    const line = document.createElement("tr");
    line.className = "built-in";
    const types = use.name.types.join(", ") || "not known";
    line.append(...[use.operation, use.name.name, types, use.holder.name, use.why.join("; ")].map((text) => {
      const cell = document.createElement("td");
      cell.textContent = text;
      return cell;
    }));
    return line;
  }

  function filterRows() {
    const wanted = byId("row-filter").value.toLowerCase();
    for (const enclave of document.querySelectorAll("details.enclave")) {
      let some = false;
      for (const line of enclave.querySelectorAll("tbody tr")) {
        const fits = line.textContent.toLowerCase().includes(wanted);
        line.classList.toggle("filtered", !fits);
        some = some || (fits && (!line.classList.contains("built-in") || byId("rows-built-in").checked));
      }
      enclave.hidden = Boolean(wanted) && !some;
      if (wanted && some) enclave.open = true;
    }
  }

  // -- light and dark, print, keyboard -------------------------------------------------------------------------------

  const restyle = () => graph.style(style());
  const isDark = () => (document.documentElement.dataset.theme
    || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";

  byId("theme").addEventListener("click", () => {
    document.documentElement.dataset.theme = isDark() ? "light" : "dark";
    restyle();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", restyle);

  let before = null;
  window.addEventListener("beforeprint", () => {
    before = { theme: document.documentElement.dataset.theme, folded: [...document.querySelectorAll("details:not([open])")] };
    document.documentElement.dataset.theme = "light";
    for (const each of before.folded) each.open = true;
    restyle();
  });
  window.addEventListener("afterprint", () => {
    if (before.theme) document.documentElement.dataset.theme = before.theme;
    else delete document.documentElement.dataset.theme;
    for (const each of before.folded) each.open = false;
    restyle();
  });

  const zoomBy = (factor) => graph.zoom({ level: graph.zoom() * factor,
    renderedPosition: { x: graph.width() / 2, y: graph.height() / 2 } });
  const KEYS = {
    ArrowLeft: () => graph.panBy({ x: 60, y: 0 }), ArrowRight: () => graph.panBy({ x: -60, y: 0 }),
    ArrowUp: () => graph.panBy({ x: 0, y: 60 }), ArrowDown: () => graph.panBy({ x: 0, y: -60 }),
    "+": () => zoomBy(1.25), "-": () => zoomBy(0.8), 0: () => graph.fit(undefined, 20), Escape: () => choose(null),
  };
  byId("canvas").addEventListener("keydown", (event) => {
    const action = event.ctrlKey || event.metaKey || event.altKey ? undefined : KEYS[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
  // The wheel zooms once somebody is in the graph; before that it scrolls the page.
  byId("canvas").addEventListener("pointerdown", () => byId("canvas").focus());
  byId("canvas").addEventListener("focus", () => graph.userZoomingEnabled(true));
  byId("canvas").addEventListener("blur", () => graph.userZoomingEnabled(false));
  byId("matches").addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const buttons = [...byId("matches").querySelectorAll("button")];
    const next = buttons[buttons.indexOf(document.activeElement) + step];
    if (!step || !next) return;
    event.preventDefault();
    next.focus();
  });
  document.addEventListener("keydown", (event) => {
    if (event.key !== "/" || event.target.matches("input, select")) return;
    event.preventDefault();
    byId("search").focus();
  });

  byId("zoom-in").addEventListener("click", KEYS["+"]);
  byId("zoom-out").addEventListener("click", KEYS["-"]);
  byId("fit").addEventListener("click", KEYS[0]);
  byId("search").addEventListener("input", search);
  byId("search").addEventListener("keydown", (event) => {
    if (event.key === "Enter" && found.length) choose(found[0].id, true);
  });
  byId("only-near").addEventListener("change", search);
  for (const id of ["group", "show-topic", "show-service", "show-action", "hide-built-in"]) {
    byId(id).addEventListener("change", draw);
  }
  byId("row-filter").addEventListener("input", filterRows);
  byId("rows-built-in").addEventListener("change", (event) => {
    addBuiltInRows();
    document.body.classList.toggle("rows-built-in", event.target.checked);
    filterRows();
  });

  draw();
  document.documentElement.dataset.ready = "true";
})();
