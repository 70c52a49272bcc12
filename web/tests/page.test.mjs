// The page in browsers: Chromium and Firefox, those that are installed. Pictures are kept in the
// folder PICTURES, if that is set.

import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after, before, describe, test } from "node:test";

import { bake } from "../js/index.js";
import { download, drop, installed, open, serve, slide, status } from "./browser.mjs";

const ROOT = path.join(path.dirname(new URL(import.meta.url).pathname), "../..");
const AXE = path.join(ROOT, "web/node_modules/axe-core/axe.min.js");
const read = (file) => fs.readFileSync(path.join(ROOT, file));
const BOX = [
  ["cornell_box.obj", read("scenes/cornell_box.obj")],
  ["cornell_box.mtl", read("scenes/cornell_box.mtl")],
];

/** Light of the files in this thread: what the page must come to. */
function expected([[name, content], ...others], error) {
  return bake({ name, content, files: Object.fromEntries(others) }, { error });
}

for (const name of ["chromium", "firefox"]) {
  describe(name, { skip: installed(name) ? false : "not installed" }, () => {
    let server;
    let opened;
    before(async () => {
      server = await serve();
      opened = await open(name, server.address);
    });
    after(async () => {
      await opened?.end();
      server?.end();
    });

    test("a dropped scene is baked to 5 %, and its files are those of the package", async () => {
      const { page, downloads, errors } = opened;
      await drop(page, BOX);
      assert.match(await status(page, /cornell_box\.obj: error/), /error \d\.?\d* %, reached/);
      const light = await expected(BOX, 0.05);
      const { name: file, bytes } = await download(page, downloads, "ply");
      assert.equal(file, "cornell_box.baked.ply");
      assert.deepEqual(bytes, Buffer.from(await light.ply()));
      const glb = await download(page, downloads, "glb");
      assert.deepEqual(glb.bytes, Buffer.from(await light.glb()));
      assert.deepEqual(errors, []);
    });

    test("a glTF scene, and what is looked at", async () => {
      const { page, downloads, errors } = opened;
      await drop(page, [["lamp_room.gltf", read("tests/data/lamp_room.gltf")]]);
      await status(page, /lamp_room\.gltf: error/);
      const draws = await page.$eval("#png", (e) => !e.disabled);
      const warnings = await page.$$eval("#warnings li", (all) => all.map((e) => e.textContent));
      assert.ok(warnings.some((text) => text.includes("lit from both sides")));
      for (const quantity of ["irradiance", "error", "0", "2", "radiosity"]) {
        await page.select("#quantity", quantity);
        if (/\d/.test(quantity)) await status(page, new RegExp(`at most ${quantity} refl.*elements`));
        assert.equal(await page.$eval("#legend", (e) => e.hidden), quantity !== "error" || !draws);
      }
      await page.click("#elements");
      await slide(page, "exposure", "1");
      if (draws) {
        const { bytes } = await download(page, downloads, "png");
        assert.equal(bytes.toString("latin1", 1, 4), "PNG");
        // Not of one colour alone.
        assert.ok(bytes.length > 5000);
      } else {
        assert.match(await page.$eval("#keys", (e) => e.textContent), /no WebGL/);
      }
      assert.deepEqual(errors, []);
    });

    test("a fine bake shows light at once, and stops with it", async () => {
      const { page, downloads, errors } = opened;
      await slide(page, "error", "100");
      await drop(page, BOX);
      await page.waitForFunction(
        () => /\d s, .*(shooting|light)/.test(document.getElementById("numbers").textContent),
        { timeout: 20000 },
      );
      await page.click("#stop");
      assert.match(await status(page, /error .*stopped/), /cornell_box\.obj/);
      assert.ok((await download(page, downloads, "ply")).bytes.length > 1000);
      await slide(page, "error", "50");
      assert.deepEqual(errors, []);
    });

    test("a tab in the background bakes on", async () => {
      const { page, errors } = opened;
      await drop(page, BOX);
      await status(page, /Baking/);
      const other = await page.browser().newPage();
      await other.bringToFront();
      assert.match(await status(page, /cornell_box\.obj: error/), /reached/);
      assert.ok(await page.evaluate(() => document.hidden));
      await other.close();
      await page.bringToFront();
      assert.deepEqual(errors, []);
    });

    test("a broken file is said, and the next one baked", async () => {
      const { page, errors } = opened;
      await drop(page, [["broken.glb", Buffer.from("glTF but no more")]]);
      assert.match(await status(page, /broken\.glb/), /;|Baking/);
      await status(page, /broken\.glb.*;/);
      await drop(page, [["picture.png", Buffer.from("x")]]);
      await status(page, /none is a scene/);
      await page.click("#box");
      await status(page, /Cornell box: error/);
      assert.deepEqual(errors, []);
    });

    test("everything is reached by the keyboard, in the order of the page", async () => {
      const { page } = opened;
      await page.focus("#canvas");
      const order = [];
      for (let k = 0; k < 15; k++) {
        order.push(await page.evaluate(() => document.activeElement.id));
        await page.keyboard.press("Tab");
      }
      const draws = await page.$eval("#png", (e) => !e.disabled);
      const all = "canvas pick box error time device bake quantity exposure elements glb ply png".split(" ");
      const wanted = all.filter((id) => draws || id !== "png");
      assert.deepEqual(order.slice(0, wanted.length), wanted);
      // Arrows turn the picture.
      if (draws) {
        const picture = () => page.$eval("#canvas", (e) => e.toDataURL());
        const seen = await picture();
        await page.focus("#canvas");
        for (let k = 0; k < 6; k++) await page.keyboard.press("ArrowLeft");
        await page.waitForFunction((seen) => document.getElementById("canvas").toDataURL() !== seen, {}, seen);
      }
    });

    test("axe-core finds nothing, at three widths, dark and light", async () => {
      const { page } = opened;
      await page.addScriptTag({ content: fs.readFileSync(AXE, "utf8") });
      for (const scheme of ["light", "dark"]) {
        // Firefox has no such command: its scheme is that of the system.
        await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]).catch(() => {});
        for (const width of [360, 768, 1280]) {
          await page.setViewport({ width, height: 800 });
          const found = await page.evaluate(async () => (await axe.run()).violations.map((v) => v.id));
          assert.deepEqual(found, [], `${scheme}, ${width} pixels`);
          const wide = await page.evaluate(() => document.documentElement.scrollWidth);
          assert.ok(wide <= width, `${wide} pixels wide at ${width}`);
          if (process.env.PICTURES) {
            await new Promise((resolve) => setTimeout(resolve, 300));
            const file = path.join(process.env.PICTURES, `${name}-${scheme}-${width}.png`);
            await page.screenshot({ path: file, fullPage: true });
          }
        }
      }
    });
  });
}

test("memory that ends is said, and the picture is kept", {
  skip: installed("chromium") ? false : "not installed",
}, async () => {
  const server = await serve();
  // 75 MiB.
  const args = ["--js-flags=--wasm-max-mem-pages=1200"];
  const { page, downloads, errors, end } = await open("chromium", server.address, { args });
  await slide(page, "error", "100");
  await page.click("#box");
  assert.match(await status(page, /The bake ended/), /memory.*picture/);
  assert.ok((await download(page, downloads, "png")).bytes.length > 5000);
  await slide(page, "error", "20");
  await page.click("#bake");
  await status(page, /Cornell box: error/);
  assert.deepEqual(errors, []);
  await end();
  server.end();
});

test("a browser is installed", () => {
  assert.ok(installed("chromium") || installed("firefox"), "install chromium or firefox-esr");
});
