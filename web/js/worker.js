// A bake in a worker of its own. Its page answers nothing while it works: that it is to stop shows
// by a token, an address that the page takes back.

import { arrays, load, run } from "./engine.js";

/** Milliseconds between looks at the token: each takes about one. */
const INTERVAL = 200;

let baked;

const answers = {
  async bake({ scene, options, token, address }) {
    await load(address && new URL(address));
    let asked = performance.now();
    const goesOn = () => {
      if (performance.now() - asked < INTERVAL) return true;
      asked = performance.now();
      return isValid(token);
    };
    const post = (type, value) => {
      postMessage({ type, value }, buffers(value));
      return goesOn();
    };
    baked?.free();
    baked = undefined;
    const done = await run(
      scene,
      options,
      (state) => post("progress", state),
      (light) => post("light", light),
    );
    baked = done.baked;
    return { ...arrays(baked.light()), report: done.report };
  },
  ply: () => baked.ply(),
  glb: () => baked.glb(),
  bounces: ({ count }) => arrays(baked.bounces(count)),
};

onmessage = async ({ data: { id, call, ...given } }) => {
  try {
    const value = await answers[call](given);
    postMessage({ type: "done", id, value }, buffers(value));
  } catch (error) {
    // After a trap, as where memory ends, the module is of no more use.
    const isTrap = error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
    postMessage({ type: "failed", id, message: String(error?.message ?? error), isTrap });
  }
};

/** Whether the page has not taken the token back. */
function isValid(token) {
  if (!token) return true;
  try {
    const request = new XMLHttpRequest();
    request.open("GET", token, false);
    request.overrideMimeType("text/plain");
    request.send();
    return request.status === 200 || request.status === 0;
  } catch {
    return false;
  }
}

/** The memory of arrays, to be handed over. */
function buffers(value) {
  const all = ArrayBuffer.isView(value) ? [value] : Object.values(value ?? {});
  return all.filter(ArrayBuffer.isView).map((array) => array.buffer);
}
