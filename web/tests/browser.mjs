// A browser with the page in it: Chromium or Firefox, as Debian has them.

import { execFileSync } from "node:child_process";
import { createServer } from "node:http";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

import puppeteer from "puppeteer-core";

const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", wasm: "application/wasm" };
const HERE = path.dirname(new URL(import.meta.url).pathname);

/** Serves the static page, with `before` in front of each script; its address and what ends it. */
export async function serve({ before = "", folder = path.join(HERE, "../dist") } = {}) {
  const server = createServer((request, response) => {
    const name = request.url === "/" ? "index.html" : path.basename(request.url.split("?")[0]);
    const file = path.join(folder, name);
    if (!fs.existsSync(file)) return response.writeHead(404).end();
    const type = TYPES[path.extname(name).slice(1)] ?? "application/octet-stream";
    const head = path.extname(name) === ".js" ? before : "";
    response.writeHead(200, { "Content-Type": type });
    response.end(Buffer.concat([Buffer.from(head), fs.readFileSync(file)]));
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return { address: `http://127.0.0.1:${server.address().port}/`, end: () => server.close() };
}

/** The path of a browser; none if it is not installed. */
export function installed(name) {
  const program = name === "firefox" ? "firefox-esr" : "chromium";
  try {
    return execFileSync("sh", ["-c", `command -v ${program}`]).toString().trim();
  } catch {
    return undefined;
  }
}

/** Opens the page: what drives it, a folder of its downloads, and what ends it. */
export async function open(name, address, { gpu = false, args = [] } = {}) {
  const downloads = fs.mkdtempSync(path.join(os.tmpdir(), "radiosity-page-"));
  const executablePath = installed(name);
  const browser = await puppeteer.launch(
    name === "firefox"
      ? {
          browser: "firefox",
          executablePath,
          extraPrefsFirefox: {
            "webgl.force-enabled": true,
            "dom.webgpu.enabled": gpu,
            "gfx.webgpu.ignore-blocklist": gpu,
            "browser.download.folderList": 2,
            "browser.download.dir": downloads,
            "browser.download.alwaysOpenPanel": false,
          },
        }
      : {
          executablePath,
          args: ["--no-sandbox", ...(gpu ? ["--enable-unsafe-webgpu"] : []), ...args],
          downloadBehavior: { policy: "allow", downloadPath: downloads },
        },
  );
  const page = await browser.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  await page.goto(address);
  const end = async () => {
    await browser.close();
    fs.rmSync(downloads, { recursive: true, force: true });
  };
  return { page, downloads, errors, end };
}

/** Drops files on the page: names and contents. */
export async function drop(page, files) {
  const given = files.map(([name, content]) => [name, Buffer.from(content).toString("base64")]);
  await page.evaluate((files) => {
    const transfer = new DataTransfer();
    for (const [name, base64] of files) {
      const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      transfer.items.add(new File([bytes], name));
    }
    const event = new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true });
    document.body.dispatchEvent(event);
  }, given);
}

/** Waits until the status of the page says so. */
export async function status(page, pattern, seconds = 120) {
  await page.waitForFunction(
    (source) => new RegExp(source).test(document.getElementById("status").textContent),
    { timeout: 1000 * seconds, polling: 50 },
    pattern.source,
  );
  return page.$eval("#status", (e) => e.textContent);
}

/** Clicks a download and answers its bytes. */
export async function download(page, folder, id) {
  // One of the same name would be replaced.
  for (const name of fs.readdirSync(folder)) fs.rmSync(path.join(folder, name));
  await page.click(`#${id}`);
  for (let k = 0; k < 200; k++) {
    await new Promise((resolve) => setTimeout(resolve, 100));
    const all = fs.readdirSync(folder);
    const isPart = (name) => /\.(part|crdownload)$/.test(name);
    const found = all.find((name) => !isPart(name));
    const size = found && fs.statSync(path.join(folder, found)).size;
    if (size > 0 && !all.some(isPart)) {
      return { name: found, bytes: fs.readFileSync(path.join(folder, found)) };
    }
  }
  throw new Error(`no download of ${id}`);
}

/** Moves a slider. */
export async function slide(page, id, value) {
  await page.$eval(
    `#${id}`,
    (slider, value) => {
      slider.value = value;
      slider.dispatchEvent(new Event("input", { bubbles: true }));
    },
    value,
  );
}
