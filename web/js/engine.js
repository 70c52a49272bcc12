// The module, in the thread that calls: loads it once, and bakes.

import init, { Files, bake as bakeFiles, initSync, version } from "../pkg/radiosity.js";

export { version };

let loading;

/** Loads the module: in Node from the file beside it, elsewhere by its address. */
export function load(address) {
  loading ??= (async () => {
    if (!hasSimd()) throw new Error(NO_SIMD);
    const url = address ?? new URL("../pkg/radiosity_bg.wasm", import.meta.url);
    if (typeof process !== "undefined" && process.versions?.node && url.protocol === "file:") {
      const { readFile } = await import("node:fs/promises");
      initSync({ module: await readFile(url) });
    } else {
      await init({ module_or_path: url });
    }
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
 * Bakes in this thread. `scene` has a name, content and files; `onProgress` and `onLight` answer
 * `false` to stop.
 */
export function run(scene, options, onProgress, onLight) {
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
  const baked = bakeFiles(
    files,
    JSON.stringify(options),
    (state) => guard(() => onProgress(JSON.parse(state))),
    (light, state) => guard(() => onLight({ ...arrays(light), ...JSON.parse(state) })),
  );
  if (thrown !== undefined) throw thrown;
  return baked;
}
