// The page's behaviour: the graph with its search and details, the filter of the tables, light and dark, print.
// All names come from launch files: they are set as text only, never as markup.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const byId = (id) => document.getElementById(id);
  const MOST_MATCHES = 200; // listed at once; the rest is counted
  const LAYERED = 100; // nodes and names up to which the graph is arranged along its arrows; more stand in rows, at once
  const READABLE = 0.5; // magnification below which labels cannot be read
  const LARGEST = 1.4; // magnification that fits a small graph
  const NARROW = 600; // pixels below which arrows run downwards
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
    const named = { label: "data(label)", color: text, "font-size": 12, "min-zoomed-font-size": 5, "text-valign": "center",  height: 30, "border-width": 1, "border-color": color("line") };
    return [
      { selector: "node", style: named },
      { selector: "node[width]", style: { width: "data(width)" } },
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

  const widthOf = (element) => Math.max(80, shortened(element.name).length * 6.8 + (element.what === "action" ? 50 : 24));

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
      data: { id: element.id, label: shortened(element.name), width: widthOf(element), parent: parentOf(element, grouping, groups) },
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
    const width = 225 * Math.ceil(Math.sqrt(inner.length / 2));
    let left = 0, top = 0, tallest = 0;
    for (const { ids, columns } of sizes) {
      const across = columns * 215 + 50, down = Math.ceil(ids.length / columns) * 42 + 60;
      if (left > 0 && left + across > width) { left = 0; top += tallest; tallest = 0; }
      ids.forEach((id, number) => {
        positions[id] = { x: left + (number % columns) * 215, y: top + Math.floor(number / columns) * 42 };
      });
      left += across;
      tallest = Math.max(tallest, down);
    }
    return { name: "preset", positions, fit: false };
  }

  const alongArrows = () => ({ name: "dagre", rankDir: byId("canvas").clientWidth < NARROW ? "TB" : "LR", animate: false,
    fit: false, nodeSep: 24, rankSep: 70 });

  let graph = null;

  // Parts without an arrow or a box between them, as lists of nodes.
  function partsOf(shown) {
    const leaves = shown.nodes(":childless");
    const part = new Map(leaves.map((node) => [node.id(), node.id()]));
    const root = (id) => { while (part.get(id) !== id) id = part.get(id); return id; };
    const join = (one, other) => part.set(root(one), root(other));
    shown.edges().forEach((edge) => {
      if (part.has(edge.source().id()) && part.has(edge.target().id())) join(edge.source().id(), edge.target().id());
    });
    shown.nodes(":orphan").forEach((box) => {
      const inside = box.descendants(":childless").filter((node) => part.has(node.id()));
      inside.forEach((node) => join(node.id(), inside[0].id()));
    });
    const parts = new Map();
    leaves.forEach((node) => {
      const id = root(node.id());
      parts.set(id, (parts.get(id) || graph.collection()).union(node));
    });
    return [...parts.values()];
  }

  // What dagre arranges one below the other stands side by side, in rows of about the canvas' shape.
  function pack(shown) {
    const gap = 40;
    const boxes = partsOf(shown).map((nodes) => ({ nodes, box: nodes.union(nodes.ancestors()).boundingBox() }));
    if (boxes.length < 2) return;
    const area = boxes.reduce((sum, each) => sum + (each.box.w + gap) * (each.box.h + gap), 0);
    const shape = byId("canvas").clientWidth / (window.innerHeight * 0.7);
    const width = Math.max(Math.sqrt(area * shape), ...boxes.map((each) => each.box.w + gap));
    let left = 0, top = 0, tallest = 0;
    graph.batch(() => {
      for (const { nodes, box } of boxes.sort((one, other) => other.box.h - one.box.h)) {
        if (left > 0 && left + box.w > width) { left = 0; top += tallest + gap; tallest = 0; }
        nodes.shift({ x: left - box.x1, y: top - box.y1 });
        left += box.w + gap;
        tallest = Math.max(tallest, box.h);
      }
    });
  }

  // The canvas is as wide as the page, and as high as what is seen needs at that width.
  function fit(seen) {
    const shown = seen || graph.elements(":visible");
    const box = shown.boundingBox();
    const width = byId("canvas").clientWidth;
    const wanted = box.w > 0 ? Math.min(width / (box.w + 40), LARGEST) * (box.h + 40) : 0;
    byId("canvas").style.height = `${Math.max(260, Math.min(wanted, window.innerHeight * 0.75))}px`;
    graph.resize();
    graph.fit(shown, 20);
    if (graph.zoom() > LARGEST) {
      graph.zoom(LARGEST);
      graph.center(shown);
    }
  }

  let home = new Map(); // where elements stand while nothing is left out
  let regrouped = false; // what is seen is arranged by itself

  function draw() {
    const elements = graphElements();
    const few = elements.filter((each) => each.group === "nodes" && each.classes !== "group").length <= LAYERED;
    if (graph) graph.destroy();
    graph = window.cytoscape({ container: byId("canvas"), elements, style: style(), minZoom: 0.02, maxZoom: 4,
      layout: few ? alongArrows() : inRows(elements), userZoomingEnabled: document.activeElement === byId("canvas"),
      hideEdgesOnViewport: elements.length > MANY, textureOnViewport: elements.length > MANY });
    if (few) pack(graph.elements());
    home = new Map(graph.nodes().map((node) => [node.id(), { ...node.position() }]));
    regrouped = isMarked = false;
    graph.on("tap", "node, edge", (event) => choose(event.target.id()));
    graph.on("tap", (event) => { if (event.target === graph) choose(null); });
    fit();
    search();
  }

  // -- search and details --------------------------------------------------------------------------------------------

  let chosen = null;
  let found = [];

  const searched = () => byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const isSearching = () => searched().length > 0;

  let proposed = null; // what is shown first of a large launch, until somebody searches

  function search() {
    const words = searched();
    if (words.length && proposed) {
      if (chosen === proposed) choose(null);
      proposed = null;
    }
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
    const nearest = centre.union(centre.descendants()).closedNeighborhood();
    // Of an enclave its names are not enough: who is at their other end is seen, too.
    const near = picked.isParent() ? nearest.union(nearest.filter(".topic, .service, .action").closedNeighborhood()) : nearest;
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
    if (only && seen.nodes(":childless").length <= LAYERED) {
      seen.layout(alongArrows()).run();
      pack(seen);
      fit(seen);
      regrouped = true;
    } else if (regrouped) {
      graph.batch(() => graph.nodes(":childless").forEach((node) => node.position(home.get(node.id()))));
      fit();
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
    if (centre && drawn.nonempty() && !regrouped && !inSight(drawn)) {
      graph.zoom(Math.max(graph.zoom(), 0.7));
      graph.center(drawn);
    }
  }

  function inSight(drawn) {
    const box = drawn.renderedBoundingBox();
    return graph.zoom() >= READABLE && box.x1 >= 0 && box.y1 >= 0 && box.x2 <= graph.width() && box.y2 <= graph.height();
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
    "+": () => zoomBy(1.25), "-": () => zoomBy(0.8), 0: () => fit(), Escape: () => choose(null),
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

  // -- enclaves to choose from ---------------------------------------------------------------------------------------

  const tables = [...document.querySelectorAll("details.enclave")];
  const choosers = [...document.querySelectorAll("#enclaves button")];

  function showEnclave(number) {
    tables.forEach((each) => { each.open = each.dataset.enclave === number; });
    choosers.forEach((each) => each.setAttribute("aria-current", String(each.dataset.enclave === number)));
  }
  for (const button of choosers) {
    button.addEventListener("click", () => {
      showEnclave(button.dataset.enclave);
      choose(`e${button.dataset.enclave}`, true);
      tables[Number(button.dataset.enclave)].scrollIntoView({ block: "nearest" });
    });
  }
  if (choosers.length) choosers[0].setAttribute("aria-current", "true");

  draw();
  // Of a large launch the busiest enclave is shown with its neighbours, so that its names can be read.
  if (graph.zoom() < READABLE && enclaves.length > 1) {
    const weight = (enclave) => members.filter((each) => each.enclave === enclave.name)
      .reduce((sum, each) => sum + each.uses.filter((use) => !use.builtIn).length, 0);
    const busiest = enclaves.reduce((best, each) => (weight(each) > weight(best) ? each : best));
    byId("only-near").checked = true;
    choose(busiest.id);
    proposed = busiest.id;
    byId("status").textContent += `. Shown: ${busiest.name} and its neighbours; choose another one in the list`;
  }
  window.addEventListener("resize", () => fit());
  document.documentElement.dataset.ready = "true";
})();
