// The module, in the thread that calls: loads it once, and bakes.

import init, { Files, ask, initSync, result, version } from "../pkg/radiosity.js";
import { canSuspend } from "./suspend.js";

export { version };

/** What the module exports without glue, once it is loaded. */
let loading;
/** The last bake: one that waits for a device may not be overtaken. */
let last = Promise.resolve();

/** Loads the module: in Node from the file beside it, elsewhere by its address. */
export function load(address) {
  loading ??= (async () => {
    if (!hasSimd()) throw new Error(NO_SIMD);
    const url = address ?? new URL("../pkg/radiosity_bg.wasm", import.meta.url);
    if (typeof process !== "undefined" && process.versions?.node && url.protocol === "file:") {
      const { readFile } = await import("node:fs/promises");
      return initSync({ module: await readFile(url) });
    }
    return init({ module_or_path: url });
  })();
  return loading;
}

const NO_SIMD =
  "this browser has no SIMD for WebAssembly: take one of 2021 or later (Safari: of 2023)";

/** Whether WebAssembly has 128-bit SIMD: by a module of one function that makes a vector. */
export function hasSimd() {
  const one = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65];
  return WebAssembly.validate(new Uint8Array([...one, 0, 253, 15, 253, 98, 11]));
}

/** Arrays of light, that stay when the memory of the module grows. */
export function arrays(light) {
  const { positions, normals, radiosity, irradiance, error, faces } = light;
  return { positions, normals, radiosity, irradiance, error, faces };
}

/**
 * The GPU that can cast rays here: a name, and whether it is software, which is slower than the
 * CPU; or what is missing.
 */
export async function gpu() {
  if (!globalThis.navigator?.gpu) return { missing: "there is no WebGPU here" };
  if (!canSuspend) return { missing: "WebAssembly cannot wait for it (no Promise Integration)" };
  const adapter = await navigator.gpu.requestAdapter().catch(() => null);
  if (!adapter) return { missing: "WebGPU has no adapter here" };
  const { description, vendor, architecture, isFallbackAdapter } = adapter.info;
  const name = description || [vendor, architecture].filter(Boolean).join(" ") || "unnamed";
  return { name, isSoftware: isFallbackAdapter ?? adapter.isFallbackAdapter ?? false };
}

/**
 * Bakes in this thread. `scene` has a name, content and files; `onProgress` and `onLight` answer
 * `false` to stop.
 */
export function run(scene, options, onProgress, onLight) {
  const own = last.then(() => runAlone(scene, options, onProgress, onLight));
  last = own.catch(() => {});
  return own;
}

async function runAlone(scene, { device = "auto", ...options }, onProgress, onLight) {
  const exports = await loading;
  const { chosen, name, reason } = await choose(device);
  const files = new Files(scene.name, scene.content);
  for (const [name, content] of Object.entries(scene.files ?? {})) files.add(name, content);
  let thrown;
  const guard = (call) => {
    try {
      return call() !== false;
    } catch (error) {
      thrown ??= error;
      return false;
    }
  };
  ask(
    files,
    JSON.stringify({ ...options, device: chosen }),
    (state) => guard(() => onProgress(JSON.parse(state))),
    (light, state) => guard(() => onLight({ ...arrays(light), ...JSON.parse(state) })),
  );
  if (chosen === "cpu") exports.work();
  else await WebAssembly.promising(exports.work)();
  const baked = result();
  if (thrown !== undefined) throw thrown;
  const report = JSON.parse(baked.report());
  report.deviceName = report.device === "gpu" ? name : null;
  report.deviceReason = reason ?? null;
  return { baked, report };
}

/** What casts rays by this option, the name of a GPU, and why there is none. */
async function choose(device) {
  if (device === "cpu") return { chosen: "cpu" };
  if (device !== "auto" && device !== "gpu") {
    throw new TypeError(`device: ${JSON.stringify(device)}; give "auto", "cpu" or "gpu"`);
  }
  const { name, missing, isSoftware } = await gpu();
  if (device === "gpu" && missing) throw new Error(`device: no GPU, ${missing}; give "cpu" or "auto"`);
  const reason = missing ?? (isSoftware ? "its WebGPU is software, slower than the CPU" : undefined);
  return device === "auto" && reason ? { chosen: "cpu", reason } : { chosen: device, name };
}
