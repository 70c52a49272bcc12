// The package in Node: the same bytes as the program's, and what it says of wrong input.

import assert from "node:assert/strict";
import { File } from "node:buffer";
import { createHash } from "node:crypto";
import fs from "node:fs";
import path from "node:path";
import { test } from "node:test";

import { bake, hasSimd, moduleVersion } from "../js/index.js";

const ROOT = path.join(path.dirname(new URL(import.meta.url).pathname), "../..");

/** A scene of the source tree, with the libraries beside it. */
function sceneOf(file) {
  const folder = path.dirname(path.join(ROOT, file));
  const libraries = fs.readdirSync(folder).filter((name) => name.endsWith(".mtl"));
  const files = libraries.map((name) => [name, fs.readFileSync(path.join(folder, name))]);
  const content = fs.readFileSync(path.join(ROOT, file));
  return { name: path.basename(file), content, files: Object.fromEntries(files) };
}

const BOX = sceneOf("scenes/cornell_box.obj");
const SQUARE = { name: "it.obj", content: "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n" };

test("eight bakes have the bytes that they have on every platform", async () => {
  const table = JSON.parse(fs.readFileSync(path.join(ROOT, "tests/data/same_bytes.json")));
  assert.equal(table.length, 8);
  for (const { scene, sha256, ...options } of table) {
    const light = await bake(sceneOf(scene), options);
    const hash = createHash("sha256").update(await light.ply()).digest("hex");
    assert.equal(hash, sha256, `${scene} to ${options.error}`);
    light.dispose();
  }
});

test("light is arrays with a report", async () => {
  const heard = [];
  const better = [];
  const light = await bake(BOX, {
    error: 0.05,
    onProgress: (state) => void heard.push(state),
    onLight: (arrays) => void better.push(arrays),
  });
  const vertices = light.positions.length / 3;
  assert.equal(light.report.vertices, vertices);
  for (const array of [light.normals, light.radiosity, light.irradiance]) {
    assert.equal(array.length, 3 * vertices);
  }
  assert.equal(light.error.length, vertices);
  assert.ok(light.faces.every((corner) => corner < vertices));
  assert.ok(light.report.reached && light.report.error <= 0.05 && light.report.warnings.length === 0);
  assert.ok(heard.length > 0 && heard.every(({ seconds }) => seconds >= 0));
  // First shapes, then what is shot, then what gathers.
  assert.ok(better.length >= 3 && better[0].stage === "shape" && better.at(-1).error > 0);
  assert.ok(better.every(({ positions, camera }) => positions.length > 0 && camera.eye.length === 3));
  const [dark, direct] = [await light.bounces(0), await light.bounces(1)];
  const sum = (array) => array.reduce((a, b) => a + b, 0) / array.length;
  assert.ok(sum(dark.radiosity) < sum(direct.radiosity));
  assert.equal(new TextDecoder().decode((await light.glb()).slice(0, 4)), "glTF");
});

test("a glTF scene comes back as it is, with light", async () => {
  const light = await bake(sceneOf("tests/data/lamp_room.gltf"), { error: 0.3 });
  const file = JSON.parse(new TextDecoder().decode(await light.glb()));
  assert.deepEqual(file.nodes.map(({ name }) => name), ["floor", "walls", "table", "lamp", "spot"]);
  assert.ok(file.meshes.every(({ primitives: [{ attributes }] }) => "_IRRADIANCE" in attributes));
});

test("it stops with what there is", async () => {
  for (const options of [{ onProgress: () => false }, { onLight: () => false }]) {
    const light = await bake(BOX, { error: 0.001, ...options });
    assert.ok(light.report.stopped && light.positions.length > 0);
  }
  const stop = new AbortController();
  const light = await bake(BOX, { error: 0.001, signal: stop.signal, onLight: () => stop.abort() });
  assert.ok(light.report.stopped);
  await assert.rejects(bake(BOX, { signal: AbortSignal.abort() }), { name: "AbortError" });
  const mine = new Error("mine");
  const fail = () => {
    throw mine;
  };
  await assert.rejects(bake(BOX, { error: 0.001, onProgress: fail }), mine);
});

test("a time ends it", async () => {
  const light = await bake(BOX, { time: 1 });
  assert.ok(light.report.error < 0.2);
});

test("lamps, skies and suns are options", async () => {
  const white = { ...SQUARE, name: "it.obj" };
  const sky = await bake(white, { sky: [1, 0, 0], error: 0.3 });
  // An open square below a sky of radiance 1: irradiance π, half of it reflected.
  assert.ok(Math.abs(sky.radiosity[0] - Math.PI / 2) < 0.05 && sky.radiosity[1] === 0);
  const sun = { direction: [0, 0, 2], irradiance: 3 };
  const lit = await bake(white, { sun, error: 0.3 });
  assert.ok(Math.abs(lit.radiosity[0] - 1.5) < 1e-3);
});

test("wrong input gets a clear error", async () => {
  const cases = [
    [{ name: "it.obj", content: "v 0 0 x\nf 1 1 1\n" }, {}, /it\.obj:1.*;/],
    [{ name: "it.glb", content: new Uint8Array([1, 2, 3]) }, {}, /it\.glb/],
    [{ name: "it.obj", content: "" }, {}, /it\.obj.*;/],
    [SQUARE, { error: 0 }, /error 0.*above 0/],
    [SQUARE, { error: 2 }, /error 2.*above 0/],
    [SQUARE, { error: "5 %" }, /options.*;/],
    [SQUARE, { eror: 0.1 }, /options.*unknown field `eror`/],
    [SQUARE, { time: -1 }, /time: -1.*above 0/],
    [SQUARE, { emit: { none: 1 } }, /no material 'none'/],
    [SQUARE, { sky: -1 }, /sky.*at least 0/],
    [SQUARE, { sun: { direction: [0, 0, 0], irradiance: 1 } }, /sun.*not zero/],
    [SQUARE, { sky: [1, 2] }, /options.*;/],
    [{ name: "it.obj", content: 3 }, {}, /content: give/],
    [{ content: "" }, {}, /scene: give/],
    [undefined, {}, /scene: give/],
    [[], {}, /none is a scene/],
    [[new File(["x"], "a.png")], {}, /a\.png: none is a scene/],
  ];
  for (const [scene, options, message] of cases) {
    await assert.rejects(bake(scene, options), ({ message: found }) => {
      assert.match(found, message);
      return true;
    });
  }
  // It bakes on after that.
  assert.ok((await bake(SQUARE, { error: 0.5 })).report.reached);
});

test("files are found by their paths", async () => {
  const obj = "mtllib lib/m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl lamp\nf 1 2 3\n";
  const at = (file, name) => Object.defineProperty(file, "webkitRelativePath", { value: name });
  const files = [
    at(new File([obj], "a.obj"), "room/a.obj"),
    at(new File(["newmtl lamp\nKe 1 1 1\n"], "m.mtl"), "room/lib/m.mtl"),
  ];
  const light = await bake(files, { error: 0.5 });
  assert.ok(light.report.warnings.length === 0 && light.radiosity[0] > 3);
});

test("what it is", async () => {
  assert.ok(hasSimd());
  assert.match(await moduleVersion(), /^\d+\.\d+\.\d+$/);
});
