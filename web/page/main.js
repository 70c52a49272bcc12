// The page: a scene in, light out.

import { bake, gpu, hasSimd } from "../js/index.js";
import { RAMP } from "./colours.js";
import { Viewer } from "./viewer.js";

const at = (id) => document.getElementById(id);
const viewer = makeViewer();
const WASM = "radiosity.wasm";

/** Files of the scene, what it is called, its light, and what stops its bake. */
let scene;
let name;
let light;
let running;
/** What is looked at: light, or some of its reflections. */
let shown;

// Sliders: errors from 50 to 0.5 % and times from 1 s to 10 min, by equal ratios; the last is none.
const errorOf = (slider) => 0.5 * 0.01 ** (slider / 100);
const timeOf = (slider) => (slider >= 100 ? undefined : 600 ** (slider / 100));
const words = (x) => (x >= 10 ? x.toFixed(0) : x.toPrecision(2));

/** What draws; where the browser cannot, nothing is drawn, and all else works. */
function makeViewer() {
  try {
    return new Viewer(at("canvas"));
  } catch {
    at("keys").textContent = "This browser draws nothing: it has no WebGL. Bakes and files work.";
    at("keys").className = "missing";
    return { frame() {}, show() {}, png: undefined };
  }
}

function showSettings() {
  at("error-value").value = `${words(100 * errorOf(+at("error").value))} %`;
  const time = timeOf(+at("time").value);
  at("time-value").value = time === undefined ? "as long as it takes" : `${words(time)} s`;
  const stops = +at("exposure").value;
  at("exposure-value").value = `${stops > 0 ? "+" : ""}${stops} stops`;
}

/** Says which GPU can cast rays, and offers it. */
async function showGpu() {
  const { name, isSoftware, missing } = await gpu();
  at("gpu").textContent = missing
    ? `GPU: none, ${missing}.`
    : `GPU: ${name}${isSoftware ? ", software: slower than the CPU, used where it is chosen" : ""}.`;
  at("device").querySelector("[value=gpu]").disabled = Boolean(missing);
}

/** Says what cast the rays of a bake. */
function showRays({ device, deviceName, deviceReason, deviceFailure }) {
  const by = device === "gpu" ? `GPU, ${deviceName}` : "CPU, one thread";
  const why = deviceReason ? `, since ${deviceReason}` : "";
  const failure = deviceFailure ? ` It failed, and the CPU went on: ${deviceFailure}.` : "";
  at("rays").textContent = `Rays by the ${by}${why}.${failure}`;
}

function say(text) {
  at("status").textContent = text;
}

function setScene(files, called) {
  [scene, name, light, shown] = [files, called, undefined, undefined];
  at("name").textContent = called;
  at("bake").disabled = false;
  for (const id of ["glb", "ply", "png"]) at(id).disabled = true;
  at("warnings").replaceChildren();
  start();
}

/** Bakes the scene; of a bake that runs it keeps nothing. */
async function start() {
  running?.abort();
  const own = new AbortController();
  running = own;
  light?.dispose?.();
  const [error, time] = [errorOf(+at("error").value), timeOf(+at("time").value)];
  at("stop").disabled = false;
  at("progress").removeAttribute("value");
  say(`Baking ${name} to ${words(100 * error)} %.`);
  let isFramed = shown !== undefined;
  let last;
  let seconds = 0;
  const show = (better) => {
    if (running !== own) return false;
    last = better;
    if (!isFramed) viewer.frame(better, better.camera);
    isFramed = true;
    if (Number.isNaN(+at("quantity").value)) look(better);
    numbers(better);
    at("png").disabled = !viewer.png;
    seconds = better.seconds;
  };
  try {
    const done = await bake(scene, {
      error,
      time,
      device: at("device").value,
      wasm: WASM,
      signal: own.signal,
      onLight: show,
      onProgress: (state) => {
        if (running !== own) return false;
        if (state.done === null) at("progress").removeAttribute("value");
        else at("progress").value = state.done;
        numbers({ ...last, ...state });
        seconds = state.seconds;
      },
    });
    if (running !== own) return done.dispose();
    light = done;
    finish(done, seconds);
  } catch (failure) {
    if (running !== own) return;
    const kept = last ? " What is shown is the light until then: a picture of it can be saved." : "";
    const why = failure.isTrap
      ? `The bake ended for want of memory, or by a defect (${failure.message})`
      : failure.message;
    say(`${why}.${kept}`);
    at("progress").value = 0;
  } finally {
    if (running === own) {
      running = undefined;
      at("stop").disabled = true;
    }
  }
}

function finish(done, seconds) {
  const { report } = done;
  at("progress").value = 1;
  const how = report.stopped ? "stopped" : report.reached ? "reached" : report.outcome;
  say(`${name}: error ${words(100 * report.error)} %, ${how}.`);
  at("numbers").textContent =
    `${seconds.toFixed(1)} s, ${report.triangles.toLocaleString("en")} triangles, ${report.vertices.toLocaleString("en")} ` +
    `vertices, ${report.gathers.toLocaleString("en")} gathers`;
  at("warnings").replaceChildren(
    ...report.warnings.map((text) => Object.assign(document.createElement("li"), { textContent: text })),
  );
  showRays(report);
  for (const id of ["glb", "ply"]) at(id).disabled = false;
  at("png").disabled = !viewer.png;
  at("canvas").setAttribute(
    "aria-label",
    `${name} in its light, ${report.triangles} triangles, error ${words(100 * report.error)} %`,
  );
  select();
}

/** Error and seconds while a bake runs. */
function numbers({ stage, error, seconds }) {
  const found = error == null ? "no estimate yet" : `error ${words(100 * error)} %`;
  at("numbers").textContent = `${seconds.toFixed(1)} s, ${found}: ${stage}`;
}

/** Draws light by the controls. */
function look(what = shown) {
  if (!what) return;
  shown = what;
  const quantity = at("quantity").value;
  const legend = viewer.show(what, quantity, +at("exposure").value, at("elements").checked);
  at("legend").hidden = !legend;
  if (legend) {
    at("legend-low").textContent = legend.low;
    at("legend-high").textContent = legend.high;
  }
}

/** Takes the quantity that is chosen: some of the reflections are computed first. */
async function select() {
  const count = +at("quantity").value;
  if (Number.isNaN(count)) return look(light ?? shown);
  if (!light) return;
  say(`Computing light of at most ${count} reflections.`);
  const of = light;
  const some = await of.bounces(count);
  if (of === light && +at("quantity").value === count) {
    look(some);
    say(`${name}: light of at most ${count} reflections, by elements.`);
  }
}

/** Saves bytes under the scene's name with an ending. */
function save(content, ending, type) {
  const address = URL.createObjectURL(new Blob([content], { type }));
  const link = Object.assign(document.createElement("a"), {
    href: address,
    download: `${name.replace(/\.[^.]*$/, "")}.baked.${ending}`,
  });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

async function cornellBox() {
  const text = async (file) => (await fetch(file)).text();
  const [content, library] = await Promise.all(["cornell_box.obj", "cornell_box.mtl"].map(text));
  setScene({ name: "cornell_box.obj", content, files: { "cornell_box.mtl": library } }, "Cornell box");
}

/** Files of what was dropped, of folders too. */
async function dropped(items) {
  const read = async (entry) => {
    if (entry.isFile) {
      const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
      const path = entry.fullPath.replace(/^\//, "");
      Object.defineProperty(file, "webkitRelativePath", { value: path.includes("/") ? path : "" });
      return [file];
    }
    const reader = entry.createReader();
    const inside = [];
    for (;;) {
      const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (some.length === 0) break;
      inside.push(...some);
    }
    return (await Promise.all(inside.map(read))).flat();
  };
  const entries = [...items].map((item) => item.webkitGetAsEntry?.() ?? item.getAsFile());
  const found = entries.map((entry) => (entry instanceof File ? [entry] : entry ? read(entry) : []));
  return (await Promise.all(found)).flat();
}

function take(files) {
  if (files.length === 0) return;
  const main = files.find((file) => /\.(glb|gltf|obj|stl)$/i.test(file.name)) ?? files[0];
  setScene(files, main.name);
}

at("controls").addEventListener("submit", (event) => {
  event.preventDefault();
  if (scene) start();
});
at("stop").addEventListener("click", () => {
  say("Stopping.");
  running?.abort();
});
at("box").addEventListener("click", () => cornellBox().catch((e) => say(`The Cornell box: ${e.message}`)));
at("pick").addEventListener("change", (event) => take([...event.target.files]));
for (const id of ["error", "time", "exposure"]) at(id).addEventListener("input", showSettings);
at("exposure").addEventListener("input", () => look());
at("elements").addEventListener("change", () => look());
at("quantity").addEventListener("change", () => select().catch((e) => say(e.message)));
at("glb").addEventListener("click", async () => save(await light.glb(), "glb", "model/gltf-binary"));
at("ply").addEventListener("click", async () => save(await light.ply(), "ply", "application/octet-stream"));
at("png").addEventListener("click", async () => save(await viewer.png(), "png", "image/png"));
addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("dropping");
});
addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) document.body.classList.remove("dropping");
});
addEventListener("drop", async (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  const { items, files } = event.dataTransfer;
  take(items?.length ? await dropped(items) : [...files]);
});

const css = RAMP.map((c) => `rgb(${c.map((x) => Math.round(255 * x)).join(" ")})`).join(", ");
at("ramp").style.background = `linear-gradient(90deg, ${css})`;
showSettings();
showGpu();
if (!hasSimd()) {
  say("This browser has no SIMD for WebAssembly, which this page needs: take one of 2021 or later.");
  for (const id of ["box", "pick", "bake"]) at(id).disabled = true;
}
