"use strict";
const at = (id) => document.getElementById(id);
// text only: what a scenario is called is no markup
const say = (id, text, kind) => {
  const place = at(id);
  if (place.textContent !== text) place.textContent = text;
  place.className = kind || "";
};
const cell = (text, kind) => {
  const made = document.createElement("span");
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
};
const bar = (share, name) => {
  const made = document.createElement("progress");
  made.max = 1;
  made.value = share;
  made.setAttribute("aria-label", name);
  return made;
};
const clock = (seconds) => {
  const minutes = Math.floor(seconds / 60);
  return minutes + ":" + (seconds - 60 * minutes).toFixed(1).padStart(4, "0");
};
const FAR_MM = 20;

function showHazards(told) {
  if (told.hazards === null) {
    at("hazards").replaceChildren(cell("Unknown in this head: nobody marked them.", "whole"));
    return;
  }
  const rows = told.hazards.map((hazard) => {
    const row = document.createElement("li");
    const [word, kind] = hazard.mm < 0 ? ["inside", "danger"]
      : hazard.mm < 1 ? ["very near", "danger"]
        : hazard.mm < 3 ? ["near", "warning"] : ["", ""];
    row.append(
      cell(hazard.name + (word ? ": " + word : ""), kind),
      bar(Math.min(Math.max(1 - hazard.mm / FAR_MM, 0), 1), "nearness of " + hazard.name),
      cell(hazard.mm.toFixed(1) + " mm", "figure " + kind));
    return row;
  });
  if (!rows.length) rows.push(cell("None within " + FAR_MM + " mm.", "whole"));
  at("hazards").replaceChildren(...rows);
}

// what is to be done now comes first; a sort keeps the order of equals
const ORDER = ["open", "failed", "waiting", "done"];
const TASK = { done: ["done", "good"], failed: ["failed", "danger"], open: ["open", ""], waiting: ["later", "quiet"] };

function showLetters(told) {
  at("letters").replaceChildren(...told.letters.map((side) => {
    const made = cell(side.letters);
    made.style.left = 50 + 46 * side.x + "%";
    made.style.top = 50 + 46 * side.y + "%";
    return made;
  }));
}

function showTasks(tasks) {
  const sorted = [...tasks].sort((a, b) => ORDER.indexOf(a.status) - ORDER.indexOf(b.status));
  const rows = sorted.map((task) => {
    const row = document.createElement("li");
    const [word, kind] = TASK[task.status];
    row.append(cell(task.title), bar(task.status === "done" ? 1 : task.progress, "progress of " + task.title),
      cell(word, "figure " + kind));
    if (task.why) row.append(cell(task.why, "whole quiet"));
    return row;
  });
  if (!rows.length) rows.push(cell("This exercise has none.", "whole"));
  at("tasks").replaceChildren(...rows);
}

let lastInjury = 0;
function showInjuries(told) {
  if (told.injury_count < lastInjury) {
    at("injuries").replaceChildren();
    lastInjury = 0;
  }
  for (const injury of told.injuries) {
    if (injury.number <= lastInjury) continue;
    const line = document.createElement("li");
    line.append(cell(clock(injury.clock_s) + "  "), cell(injury.text, "danger"));
    at("injuries").prepend(line);
    lastInjury = injury.number;
  }
  say("injury-count", told.injury_count ? "(" + told.injury_count + ")" : "(none)");
}

function show(told) {
  document.title = "PARAVOL: " + (told.title || "a flight, live");
  say("title", told.title || "A flight, live");
  const isAway = (told.device || "").startsWith("away");
  say("stage", told.is_over ? told.stage : isAway ? "The device is away: the picture stands"
    : told.is_frozen ? "Frozen: the score clock stands" : told.stage, isAway && !told.is_over ? "danger" : "");
  if (told.device) {
    say("device", [told.device, told.tool_device].filter(Boolean).join("; "), isAway ? "danger" : "");
    showInjuries(told);
  }
  if (told.clock_s !== undefined) {
    say("clock", clock(told.clock_s) + (told.is_frozen ? " (stands)" : ""));
    say("tool", told.tool);
    showLetters(told);
    say("scope", told.scope + " scope, looks to " + told.looks + "; the picture is " + told.pose_age_ms.toFixed(0) + " ms after the hand");
    say("cuts", String(told.cuts));
    const gap = told.clearance_mm;
    say("clearance", gap === null ? "outside the head"
      : gap < 0 ? "in contact, " + (-gap).toFixed(1) + " mm" + (told.touched ? " into " + told.touched : "")
        : gap > 50 ? "outside the head" : gap.toFixed(1) + " mm",
      gap !== null && gap < 0 ? "danger" : gap !== null && gap < told.near_mm ? "warning" : "");
    showHazards(told);
    showTasks(told.tasks);
  }
  at("end").hidden = !(told.result && told.result.length);
  at("result").replaceChildren(...(told.result || []).map(([name, value]) => {
    const row = document.createElement("div");
    const term = document.createElement("dt"), figure = document.createElement("dd");
    term.textContent = name;
    figure.textContent = value;
    row.append(term, figure);
    return row;
  }));
}

let wasLost = false;
const source = new EventSource("states");
source.onmessage = (event) => {
  if (wasLost) at("picture").src = "pictures?" + Date.now();
  wasLost = false;
  show(JSON.parse(event.data));
};
source.onerror = () => {
  wasLost = true;
  say("stage", "No connection: the program has ended, or was started anew and has another address", "danger");
};
