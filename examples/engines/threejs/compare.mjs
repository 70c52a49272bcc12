// Shows a baked file in index.html in headless Chromium, and compares that with the picture that
// `radiosity` drew of it: exit status 1 where they differ by more than 2 % RMS of white.
//   node compare.mjs REPORT.json FILE.glb PICTURE.png [--out SHOT.png]
// REPORT.json is that of the bake: camera and exposure. CHROMIUM names the browser
// [/usr/bin/chromium].
import { createServer } from 'node:http';
import { readFile, writeFile } from 'node:fs/promises';
import path from 'node:path';
import { parseArgs } from 'node:util';
import { chromium } from 'playwright-core';

const { values, positionals: [reportFile, file, picture] } = parseArgs({
  allowPositionals: true,
  options: { out: { type: 'string' } },
});
if (!picture) {
  console.error('usage: node compare.mjs REPORT.json FILE.glb PICTURE.png [--out SHOT.png]');
  process.exit(2);
}
const { camera, exposure } = JSON.parse(await readFile(reportFile, 'utf8'));
const types = { '.html': 'text/html', '.js': 'text/javascript' };
const here = import.meta.dirname;
const server = createServer(async (request, response) => {
  const { pathname } = new URL(request.url, 'http://localhost');
  // The folder of the file has its light maps.
  const target = pathname === '/picture.png' ? picture
    : pathname.startsWith('/file/') ? path.join(path.dirname(file), path.basename(pathname))
    : path.join(here, path.normalize(pathname));
  try {
    const bytes = await readFile(target);
    response.writeHead(200, { 'content-type': types[path.extname(target)] ?? 'application/octet-stream' }).end(bytes);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
const root = `http://127.0.0.1:${server.address().port}`;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
let status = 1;
try {
  const page = await browser.newPage({ viewport: { width: 512, height: 512 } });
  page.on('console', (message) => message.type() === 'error' && console.error(message.text()));
  page.on('pageerror', (error) => console.error(error));
  const query = new URLSearchParams({
    file: `file/${path.basename(file)}`, exposure, eye: camera.eye, target: camera.target, fov: camera.vertical_fov,
  });
  await page.goto(`${root}/index.html?${query}`);
  await page.waitForFunction('window.isShown', null, { timeout: 60000 });
  const shot = await page.screenshot();
  if (values.out) await writeFile(values.out, shot);
  const rms = await page.evaluate(async ([shot, picture]) => {
    const [a, b] = await Promise.all([shot, picture].map(async (url) => {
      const bitmap = await createImageBitmap(await (await fetch(url)).blob());
      const context = new OffscreenCanvas(512, 512).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, 512, 512).data;
    }));
    let squares = 0;
    for (let i = 0; i < a.length; i += 1) if (i % 4 < 3) squares += ((a[i] - b[i]) / 255) ** 2;
    return Math.sqrt(squares / (0.75 * a.length));
  }, [`data:image/png;base64,${shot.toString('base64')}`, '/picture.png']);
  console.log(`${path.basename(file)}: ${(100 * rms).toFixed(2)} % RMS of white from ${path.basename(picture)}`);
  status = rms < 0.02 ? 0 : 1;
} finally {
  await browser.close();
  server.close();
}
process.exit(status);
