// Bakes light: `bake(scene, options)`. In browsers it runs in a worker of its own, in Node in the
// thread that calls. `index.d.ts` has what is given and what comes back.

import { arrays, gpu, hasSimd, load, run, version } from "./engine.js";

export { gpu, hasSimd };

/** Endings of files that are scenes. */
const SCENES = ["glb", "gltf", "obj", "stl"];

export async function bake(scene, options = {}) {
  const { onProgress, onLight, signal, worker, wasm, ...asked } = options;
  const given = await files(scene);
  const calls = { onProgress: onProgress ?? (() => {}), onLight: onLight ?? (() => {}), signal };
  signal?.throwIfAborted();
  const makesWorkers = typeof Worker !== "undefined" && typeof URL.createObjectURL === "function";
  return worker !== false && makesWorkers
    ? new Baker(worker, wasm).bake(given, asked, calls)
    : direct(given, asked, calls, wasm);
}

/** Version of the module. */
export async function moduleVersion() {
  await load();
  return version();
}

/** In this thread. */
async function direct(scene, options, { onProgress, onLight, signal }, wasm) {
  await load(wasm && new URL(wasm, import.meta.url));
  const goesOn = (answer) => answer !== false && !signal?.aborted;
  const { baked, report } = await run(
    scene,
    options,
    (state) => goesOn(onProgress(state)),
    (light) => goesOn(onLight(light)),
  );
  return {
    ...arrays(baked.light()),
    report,
    ply: async () => baked.ply(),
    glb: async () => baked.glb(),
    bounces: async (count) => arrays(baked.bounces(count)),
    dispose: () => baked.free(),
  };
}

/** A worker that bakes. */
class Baker {
  #worker;
  #wasm;
  #waiting = new Map();
  #calls = 0;
  #heard = { onProgress() {}, onLight() {} };
  #token;

  constructor(worker, wasm) {
    this.#worker = worker ?? new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
    this.#wasm = wasm && new URL(wasm, globalThis.location?.href).href;
    this.#worker.onmessage = ({ data }) => this.#hear(data);
    this.#worker.onerror = (event) => {
      event.preventDefault?.();
      this.#fail(new Error(event.message || "the worker cannot be loaded"));
    };
  }

  async bake(scene, options, heard) {
    this.#heard = heard;
    this.#token = URL.createObjectURL(new Blob(["go on"]));
    const stop = () => this.#stop();
    heard.signal?.addEventListener("abort", stop);
    try {
      const address = this.#wasm;
      const light = await this.#call("bake", { scene, options, token: this.#token, address });
      return {
        ...light,
        ply: () => this.#call("ply"),
        glb: () => this.#call("glb"),
        bounces: (count) => this.#call("bounces", { count }),
        dispose: () => this.#fail(new Error("disposed")),
      };
    } catch (error) {
      this.#worker.terminate();
      throw error;
    } finally {
      heard.signal?.removeEventListener("abort", stop);
      this.#stop();
    }
  }

  #call(call, given = {}) {
    const id = ++this.#calls;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, call, ...given });
    });
  }

  #hear({ type, id, value, message, isTrap }) {
    const { onProgress, onLight } = this.#heard;
    if (type === "progress" || type === "light") {
      if ((type === "light" ? onLight : onProgress)(value) === false) this.#stop();
      return;
    }
    const { resolve, reject } = this.#waiting.get(id) ?? {};
    this.#waiting.delete(id);
    if (type === "done") resolve?.(value);
    else if (isTrap) this.#fail(Object.assign(new Error(message), { isTrap }), reject);
    else reject?.(new Error(message));
  }

  /** Takes the token back: the worker ends with what there is. */
  #stop() {
    if (this.#token) URL.revokeObjectURL(this.#token);
    this.#token = undefined;
  }

  /** Ends the worker, and all that waits for it. */
  #fail(error, ...also) {
    this.#worker.terminate();
    also.forEach((reject) => reject?.(error));
    this.#waiting.forEach(({ reject }) => reject(error));
    this.#waiting.clear();
  }
}

/** Name, content and files of a scene. */
async function files(scene) {
  const list = typeof FileList !== "undefined" && scene instanceof FileList ? [...scene] : scene;
  if (Array.isArray(list) || (typeof Blob !== "undefined" && list instanceof Blob)) {
    return ofFiles(Array.isArray(list) ? list : [list]);
  }
  if (typeof list?.name !== "string" || list.content === undefined) {
    throw new TypeError(
      "scene: give { name, content, files }, or File objects of which one is a scene",
    );
  }
  const others = Object.entries(list.files ?? {}).map(([name, content]) => [name, bytes(content)]);
  return { name: list.name, content: bytes(list.content), files: Object.fromEntries(others) };
}

/** Of File objects: the scene among them, and those beside it by their paths. */
async function ofFiles(all) {
  const path = (file) => file.webkitRelativePath || file.name;
  const ending = (file) => file.name.split(".").pop().toLowerCase();
  const rank = (file) => SCENES.indexOf(ending(file));
  const scenes = all.filter((file) => rank(file) >= 0).sort((a, b) => rank(a) - rank(b));
  if (scenes.length === 0) {
    const names = all.map((file) => file.name).join(", ") || "no file";
    throw new TypeError(`${names}: none is a scene; give a .glb, .gltf, .obj or .stl file`);
  }
  const content = async (file) => new Uint8Array(await file.arrayBuffer());
  const folder = path(scenes[0]).split("/").slice(0, -1).join("/");
  const below = (file) =>
    folder && path(file).startsWith(`${folder}/`) ? path(file).slice(folder.length + 1) : path(file);
  const others = all.filter((file) => file !== scenes[0]);
  const read = await Promise.all(others.map(async (file) => [below(file), await content(file)]));
  return { name: scenes[0].name, content: await content(scenes[0]), files: Object.fromEntries(read) };
}

function bytes(content) {
  if (typeof content === "string") return new TextEncoder().encode(content);
  if (content instanceof ArrayBuffer) return new Uint8Array(content);
  if (ArrayBuffer.isView(content)) {
    return new Uint8Array(content.buffer, content.byteOffset, content.byteLength);
  }
  throw new TypeError("content: give a Uint8Array, an ArrayBuffer or a string");
}
