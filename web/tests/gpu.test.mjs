// Rays by WebGPU, in browsers on software: the same numbers as by the program on the same driver, and
// what is said where something is missing or fails.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { describe, test } from "node:test";

import { download, drop, installed, open, serve, slide, status } from "./browser.mjs";

const ROOT = path.join(path.dirname(new URL(import.meta.url).pathname), "../..");
const BOX = ["cornell_box.obj", "cornell_box.mtl"].map((name) => [
  name,
  fs.readFileSync(path.join(ROOT, "scenes", name)),
]);

/** Software drivers of the browsers, and what the program needs to take the same. */
const BROWSERS = {
  chromium: { adapter: "SwiftShader", driver: "/usr/lib/chromium/vk_swiftshader_icd.json" },
  firefox: { adapter: "llvmpipe" },
};

// 30 %.
const SLIDER = "11";

/** Numbers at vertices of a PLY file: all but the colours. */
function numbers(bytes) {
  const end = bytes.indexOf("end_header\n") + "end_header\n".length;
  const count = +/element vertex (\d+)/.exec(bytes.toString("latin1", 0, end))[1];
  const [floats, colours, error] = [48, 3, 4];
  const size = floats + colours + error;
  const rows = Array.from({ length: count }, (_, k) => bytes.subarray(end + k * size, end + (k + 1) * size));
  return Buffer.concat([
    ...rows.flatMap((row) => [row.subarray(0, floats), row.subarray(floats + colours)]),
    bytes.subarray(end + count * size),
  ]);
}

/** The program's PLY file of the box, on this adapter as if it were hardware. */
function byProgram({ adapter, driver }, error) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "radiosity-gpu-"));
  const ply = path.join(folder, "box.ply");
  const own = driver ? { VK_ICD_FILENAMES: driver, VK_DRIVER_FILES: driver } : {};
  // One that is built already, or the one of this source.
  const built = ["run", "--locked", "--release", "--quiet", "--features", "cli", "--bin", "radiosity", "--"];
  const [program, first] = process.env.RADIOSITY ? [process.env.RADIOSITY, []] : ["cargo", built];
  const bake = ["bake", path.join(ROOT, "scenes/cornell_box.obj"), "--error", String(error), "-o", ply];
  const device = ["--adapter", adapter, "--adapter-kind", "discrete"];
  execFileSync(program, [...first, ...bake, ...device], {
    cwd: ROOT,
    env: { XDG_RUNTIME_DIR: os.tmpdir(), ...process.env, ...own },
    stdio: "ignore",
  });
  const bytes = fs.readFileSync(ply);
  fs.rmSync(folder, { recursive: true });
  return bytes;
}

/** Opens the page with WebGPU, runs `work` in it, and ends it. */
async function withPage(name, before, work, { gpu = true } = {}) {
  const server = await serve({ before });
  const opened = await open(name, server.address, { gpu });
  try {
    await opened.page.waitForFunction(() => document.getElementById("gpu").textContent !== "");
    await slide(opened.page, "error", SLIDER);
    await work(opened);
    assert.deepEqual(opened.errors, []);
  } finally {
    await opened.end();
    server.end();
  }
}

const text = (page, id) => page.$eval(`#${id}`, (e) => e.textContent);
const canChoose = (page) => page.$eval("#device [value=gpu]", (e) => !e.disabled);

for (const name of ["chromium", "firefox"]) {
  describe(name, { skip: installed(name) ? false : "not installed" }, () => {
    test("software is used where it is chosen, with the numbers of the program", async () => {
      await withPage(name, "", async ({ page, downloads }) => {
        assert.match(await text(page, "gpu"), /software: slower than the CPU/);
        await drop(page, BOX);
        await status(page, /cornell_box\.obj: error/);
        assert.match(await text(page, "rays"), /by the CPU.*since its WebGPU is software/);
        await page.select("#device", "gpu");
        await page.click("#bake");
        await status(page, /Baking/);
        assert.match(await status(page, /cornell_box\.obj: error/), /reached/);
        assert.match(await text(page, "rays"), /^Rays by the GPU, [a-z ]+\.$/);
        const { bytes } = await download(page, downloads, "ply");
        const error = 0.5 * 0.01 ** (SLIDER / 100);
        assert.ok(numbers(bytes).equals(numbers(byProgram(BROWSERS[name], error))));
      });
    });

    test("a device that is lost in the middle is said, and the CPU goes on", async () => {
      // Hardware, it says; and is lost at the tenth result.
      const before = `
        Object.defineProperty(GPUAdapterInfo.prototype, "isFallbackAdapter", { get: () => false });
        {
          const { requestDevice } = GPUAdapter.prototype;
          GPUAdapter.prototype.requestDevice = async function (...given) {
            const device = await requestDevice.apply(this, given);
            const { mapAsync } = GPUBuffer.prototype;
            let left = 10;
            GPUBuffer.prototype.mapAsync = function (...given) {
              if (--left === 0) device.destroy();
              return mapAsync.apply(this, given);
            };
            return device;
          };
        }
      `;
      await withPage(name, before, async ({ page, downloads }) => {
        assert.doesNotMatch(await text(page, "gpu"), /software/);
        await drop(page, BOX);
        assert.match(await status(page, /cornell_box\.obj: error/), /reached/);
        assert.match(await text(page, "rays"), /GPU.*failed, and the CPU went on: .*lost/);
        assert.ok((await download(page, downloads, "ply")).bytes.length > 1000);
      });
    });

    test("a device that cannot be opened is said, and the CPU takes its work", async () => {
      const before = `
        Object.defineProperty(GPUAdapterInfo.prototype, "isFallbackAdapter", { get: () => false });
        GPUAdapter.prototype.requestDevice = () => Promise.reject(new TypeError("no room for it"));
      `;
      await withPage(name, before, async ({ page }) => {
        await drop(page, BOX);
        await status(page, /cornell_box\.obj: error/);
        assert.match(await text(page, "rays"), /by the CPU.*failed.*no room for it/);
      });
    });

    test("without Promise Integration the CPU is used, and that is said", async () => {
      await withPage(name, "delete WebAssembly.Suspending;", async ({ page }) => {
        assert.match(await text(page, "gpu"), /none, .*Promise Integration/);
        assert.equal(await canChoose(page), false);
        await drop(page, BOX);
        await status(page, /cornell_box\.obj: error/);
        assert.match(await text(page, "rays"), /by the CPU.*Promise Integration/);
      });
    });

    test("without WebGPU the CPU is used, and that is said", async () => {
      await withPage(
        name,
        "",
        async ({ page }) => {
          assert.match(await text(page, "gpu"), /none, .*WebGPU/);
          assert.equal(await canChoose(page), false);
          await drop(page, BOX);
          await status(page, /cornell_box\.obj: error/);
          assert.match(await text(page, "rays"), /by the CPU.*WebGPU/);
        },
        { gpu: false },
      );
    });

    test("a bake by the GPU stops with what there is", async () => {
      await withPage(name, "", async ({ page }) => {
        await slide(page, "error", "100");
        await page.select("#device", "gpu");
        await drop(page, BOX);
        const works = () => /(shooting|light|gathering)/.test(document.getElementById("numbers").textContent);
        await page.waitForFunction(works);
        await new Promise((resolve) => setTimeout(resolve, 2000));
        await page.click("#stop");
        assert.match(await status(page, /error .*stopped/), /cornell_box\.obj/);
      });
    });
  });
}
